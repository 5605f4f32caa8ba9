"""Mirror planes and rotation axes of a shape, found in its distance grid and verified by its own distance."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from partwright.shapes import Shape
from partwright.shapes.grid import DistanceGrid
from partwright.superfrusta.settings import Settings

Floats = NDArray[np.float64]

TOLERANCE = 6e-3  # unit lengths: mean distance from the surface to its own image
NEARLY = 0.02  # likewise: what holds so far may hold for parts after a small motion of theirs
_PROMISING = 0.06  # mean distance before refinement
_ORDERS = range(2, 13)
_SAMPLES, _VERIFY_EVERY = 400, 4
_EXACT = 1e-3  # mean distance that needs no refinement
_STEPS, _WIDTH = 3, 0.01  # of Gauss-Newton; its difference quotients, about half a voxel
_LITTLE = 0.05  # of the largest singular value, under which a direction of these does not matter
_ALIKE = 0.15  # relative difference of second moments under which their axes are arbitrary
_ACROSS = 0.1  # cosine
_FAN = 12  # mirror planes through such an axis that are tried
_SAME = 0.03  # difference of matrices and shifts under which two isometries count as one


@dataclass(frozen=True)
class Isometry:
    """The map p -> linear @ p + shift, linear (3, 3) orthogonal: rigid or, at determinant -1, mirroring."""

    linear: Floats
    shift: Floats

    def __call__(self, points: NDArray[np.floating]) -> Floats:
        """Points (N, 3) moved, in float64."""
        return np.asarray(points.astype(np.float64) @ self.linear.T + self.shift)

    def __matmul__(self, first: Isometry) -> Isometry:
        """`first`, then this one."""
        return Isometry(self.linear @ first.linear, self.linear @ first.shift + self.shift)

    def inverse(self) -> Isometry:
        return Isometry(self.linear.T, -self.linear.T @ self.shift)

    @cached_property
    def improper(self) -> bool:
        return bool(np.linalg.det(self.linear) < 0)

    def near(self, other: Isometry) -> bool:
        """Whether both do the same, but for what a refinement may leave."""
        apart = max(np.abs(self.linear - other.linear).max(), np.abs(self.shift - other.shift).max())
        return bool(apart < _SAME)


@dataclass(frozen=True)
class Symmetry:
    """A mirror plane, or an axis of rotation by 1/order of a turn; unit frame.

    axis: the plane's normal or the direction of the axis, unit length. centre: a point on it. error: mean
    distance from the shape's surface to its image.
    """

    kind: Literal["mirror", "rotation"]
    order: int
    isometry: Isometry
    error: float

    @property
    def axis(self) -> Floats:
        eigenvalue = -1.0 if self.kind == "mirror" else 1.0
        _, _, v = np.linalg.svd(self.isometry.linear - eigenvalue * np.eye(3))
        return np.asarray(v[2])

    @property
    def centre(self) -> Floats:
        return _fixed_point(self.isometry)


def symmetries(
    shape: Shape, settings: Settings, seed: int = 0, tolerance: float = TOLERANCE
) -> tuple[Symmetry, ...]:
    """The shape's symmetries in the unit frame, the most exact first; none where it has none.

    Candidates are the principal axes and the world's axes and diagonals through the centre of volume; each is
    refined by Gauss-Newton on the distances of the moved surface samples.
    """
    grid = shape.unit_grid(settings.resolution)
    points = shape.unit_surface(_SAMPLES, seed).points.astype(np.float64)
    inside = grid.points_of(np.flatnonzero(grid.values < 0))
    if not len(inside):
        return ()
    centre = inside.mean(axis=0)
    moments, principal = np.linalg.eigh(np.einsum("ni,nj->ij", inside - centre, inside - centre))
    axes = _axes(principal)
    found: list[Symmetry] = []

    def consider(kind: Literal["mirror", "rotation"], order: int, candidate: Isometry) -> Isometry | None:
        if image_error(grid, candidate, points) > _PROMISING:
            return None
        best = refined(grid, candidate, points, conjugated)
        if any(s.isometry.near(best) for s in found):
            return best
        if image_error(grid, best, points) > 2 * tolerance:
            return None
        image = best(points[::_VERIFY_EVERY]).astype(np.float32)
        error = float(shape.unit_away(image).mean())
        if error > tolerance:
            return None
        found.append(Symmetry(kind, order, best, error))
        return best

    for normal in axes:
        consider("mirror", 2, mirror(normal, centre))
    for fan in _fans(moments, principal):
        if not any(s.kind == "mirror" and abs(s.axis @ fan[0]) < _ACROSS for s in found):
            # One of them is enough: products with rotations are the others.
            next((m for n in fan[1:] if (m := consider("mirror", 2, mirror(n, centre)))), None)
    for axis in axes:
        through = centre
        for order in _ORDERS:
            accepted = consider("rotation", order, rotation(axis, 2 * math.pi / order, through))
            if accepted is not None:
                through = _fixed_point(accepted, near=centre)
    return tuple(sorted(found, key=lambda s: s.error))


def mirror(normal: Floats, point: Floats) -> Isometry:
    """Reflection in the plane through `point` with a unit normal."""
    return Isometry(np.eye(3) - 2 * np.outer(normal, normal), 2 * normal * (normal @ point))


def rotation(axis: Floats, angle: float, point: Floats) -> Isometry:
    """Rotation by `angle` about the unit axis through `point` (Rodrigues)."""
    linear = _turn(axis * angle)
    return Isometry(linear, point - linear @ point)


def groups(found: Sequence[Symmetry], most: int = 24) -> list[tuple[Isometry, ...]]:
    """Sets of isometries under which a part may repeat: what all mirrors generate together, and what each
    symmetry does alone. Sets of more than `most` are left out, and so is the identity."""
    cyclic = [_generated([s.isometry], most) for s in found]
    mirrors = [s.isometry for s in found if s.kind == "mirror"]
    together = [_generated(mirrors, most)] if len(mirrors) > 1 else []
    return [group for group in [*together, *cyclic] if group]


def generated_by(found: Sequence[Symmetry], tolerance: float, most: int = 24) -> tuple[Isometry, ...]:
    """What the symmetries that hold to a tolerance generate together, the most exact first, and none that
    makes more than `most` of them; the identity is left out."""
    generators: list[Isometry] = []
    generated: tuple[Isometry, ...] = ()
    for one in found:
        wider = _generated([*generators, one.isometry], most) if one.error <= tolerance else ()
        if wider:
            generators, generated = [*generators, one.isometry], wider
    return generated


def _generated(generators: list[Isometry], most: int) -> tuple[Isometry, ...]:
    """All products but the identity; none if there are more than `most`."""
    elements = [Isometry(np.eye(3), np.zeros(3))]
    for element in elements:  # grows on the way
        for generator in generators:
            product = generator @ element
            if not any(product.near(known) for known in elements):
                elements.append(product)
        if len(elements) > most:
            return ()
    return tuple(elements[1:])


def _axes(principal: Floats) -> list[Floats]:
    """Unit directions (3,): principal axes, the world's axes and the diagonals between them, none twice."""
    world = np.eye(3)
    diagonals = [
        (world[i] + sign * world[j]) / math.sqrt(2) for i, j in ((0, 1), (1, 2), (0, 2)) for sign in (1, -1)
    ]
    kept: list[Floats] = []
    for direction in [*world, *principal.T, *diagonals]:
        if all(abs(direction @ other) < math.cos(math.radians(2)) for other in kept):
            kept.append(np.asarray(direction))
    return kept


def _fans(moments: Floats, principal: Floats) -> Iterator[Floats]:
    """Where principal axes are arbitrary, as across an axis of revolution: (1 + K, 3) that axis, and
    directions across it."""
    for i, j, along in ((0, 1, 2), (1, 2, 0)):
        if moments[j] - moments[i] < _ALIKE * moments[j]:
            angle = np.arange(_FAN)[:, None] * math.pi / _FAN
            across = np.cos(angle) * principal[:, i] + np.sin(angle) * principal[:, j]
            yield np.concatenate([principal[None, :, along], across])


def image_error(grid: DistanceGrid, isometry: Isometry, points: Floats) -> float:
    """Mean distance from the surface of the images of points (N, 3)."""
    return float(np.abs(grid.read(isometry(points))).mean())


def refined(
    grid: DistanceGrid,
    isometry: Isometry,
    points: Floats,
    moved: Callable[[Isometry, Isometry], Isometry],
    enough: float = _EXACT,
) -> Isometry:
    """An isometry that brings the images of points (N, 3) closer to the surface, by Gauss-Newton.

    moved: it after a small rigid motion. enough: mean distance that needs no more.
    """
    residual = grid.read(isometry(points))
    off = float(np.abs(residual).mean())
    for _ in range(_STEPS):
        if off < enough:
            break
        nudged = [moved(isometry, nudge) for nudge in _NUDGES]
        images = points @ np.concatenate([one.linear for one in nudged]).T
        images += np.concatenate([one.shift for one in nudged])
        jacobian = (grid.read(images.reshape(-1, 3)).reshape(-1, len(nudged)) - residual[:, None]) / _WIDTH
        better = moved(isometry, _motion(np.clip(_least_squares(jacobian, -residual), -0.1, 0.1)))
        residual = grid.read(better(points))
        nearer = float(np.abs(residual).mean())
        if nearer >= off:
            break
        isometry, off = better, nearer
    return isometry


def _least_squares(matrix: Floats, right: Floats) -> Floats:
    """(k,) of matrix (n, k), n far larger, without directions that hardly matter; the ways of NumPy for any
    matrix take three times as long."""
    values, axes = np.linalg.eigh(matrix.T @ matrix)
    along = axes.T @ (matrix.T @ right)
    matters = values > _LITTLE**2 * values[-1]
    return np.asarray(axes @ np.divide(along, values, out=np.zeros_like(along), where=matters))


def conjugated(isometry: Isometry, motion: Isometry) -> Isometry:
    """E T E^-1 under a rigid motion E. That keeps what T is: a mirror stays one, a rotation keeps its
    angle."""
    return motion @ isometry @ motion.inverse()


def shifted(isometry: Isometry, motion: Isometry) -> Isometry:
    """E T under a rigid motion E."""
    return motion @ isometry


def _motion(twist: Floats) -> Isometry:
    """The rigid motion of a twist (6,): a rotation vector and a shift."""
    return Isometry(_turn(twist[:3]), twist[3:])


def _turn(vector: Floats) -> Floats:
    """Rotation matrix (3, 3) of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)


def _fixed_point(isometry: Isometry, near: Floats | None = None) -> Floats:
    """The fixed point nearest to `near` (the origin)."""
    start = np.zeros(3) if near is None else near
    missing = isometry.shift - (start - isometry.linear @ start)
    return np.asarray(start + np.linalg.pinv(np.eye(3) - isometry.linear, rcond=1e-6) @ missing)


_NUDGES = [_motion(_WIDTH * unit) for unit in np.eye(6)]
