"""A convex solid as one of those that physics engines have natively: nearest to it, around it, or within it.

Placed along the given axes, the principal ones and those of the smallest box; sized by moments or by what
has to be within. How far off each is follows from support functions: of two convex bodies, the largest
difference of
their supports over all directions is the Hausdorff distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.approximation.hull_faces import beyond_faces, faces_of
from partwright.approximation.largest_within import LARGEST, largest_within
from partwright.approximation.smallest_ball import smallest_ball
from partwright.assembly import Part, Similarity
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.manifolds import surface_of
from partwright.rows import crosses, following

if TYPE_CHECKING:
    from manifold3d import Manifold

CONVEX_KINDS = (Box, Cylinder, Sphere, Capsule, Ellipsoid)  # that a convex solid can become
Mode = Literal["nearest", "around", "within"]
_DIRECTIONS = 400  # on the sphere, in which supports are compared, beside the faces' own
_CELLS = 18  # along each side of the lattice on which volumes are compared
_ROUNDS = 400  # of the algorithm for the smallest ellipsoid, at most
_TRIED = 40  # faces of a hull that a box is laid along
_MARGIN = 1e-6  # of the size: room around, so that rounding leaves nothing outside


@dataclass(frozen=True)
class ConvexFit:
    """part: the solid, placed. volume_error_ratio: volume in one of the two only, over the convex solid's.
    deviation: Hausdorff distance of the two."""

    part: Part
    volume_error_ratio: float
    deviation: float


@dataclass(frozen=True, eq=False)
class _Body:
    """A convex polytope: corners (V, 3), faces' normals (F, 3) and offsets (F,), second moments (3, 3)."""

    corners: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    volume: float
    centre: np.ndarray
    spread: np.ndarray

    @classmethod
    def of(cls, hull: Manifold) -> _Body:
        corners, faces = surface_of(hull)
        normals, offsets = faces_of(hull)
        origin = corners.mean(axis=0)
        a, b, c = (corners - origin)[faces.T]
        six = np.einsum("ij,ij->i", a, np.cross(b, c))
        total = six.sum()
        centre = ((a + b + c) * six[:, None]).sum(axis=0) / (4 * total)
        every = a + b + c
        second = np.einsum("i,ij,ik->jk", six, every, every)
        second += sum(np.einsum("i,ij,ik->jk", six, one, one) for one in (a, b, c))
        spread = second / (20 * total) - np.outer(centre, centre)
        return cls(corners, normals, offsets, total / 6, centre + origin, spread)

    @cached_property
    def lattice(self) -> tuple[np.ndarray, float, np.ndarray]:
        """Points (N, 3) of the polytope's box, their spacing, and how much (N,) of each one's cell is
        inside."""
        lower, upper = self.corners.min(axis=0), self.corners.max(axis=0)
        step = (upper - lower) / _CELLS
        axes = [low + h * (np.arange(_CELLS) + 0.5) for low, h in zip(lower, step, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        distance = beyond_faces(points, self.normals, self.offsets)
        cell = float(step.min())
        return points, cell, np.clip(0.5 - distance / cell, 0, 1)

    @cached_property
    def frames(self) -> list[np.ndarray]:
        """Rotations (3, 3), columns the axes: the given ones, the principal ones, the smallest box's."""
        found = [np.eye(3), np.linalg.eigh(self.spread)[1], _smallest_box(self)]
        return [frame * [1, 1, np.sign(np.linalg.det(frame))] for frame in found]

    @cached_property
    def supports(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions (N, 3) all around and along the faces' normals, and how far (N,) it reaches in each."""
        directions = np.concatenate([_directions(), self.normals])
        return directions, (directions @ self.corners.T).max(axis=1)


def convex_fits(
    hull: Manifold,
    kinds: Sequence[type[Field]],
    mode: Mode,
    deviation: float = math.inf,
    error: float = math.inf,
) -> list[ConvexFit]:
    """The best solid of each kind by volume, the best of all first; kinds without one are left out.

    hull: convex. kinds: of `CONVEX_KINDS`. mode: "around" contains every
    corner of the hull, "within" lies inside all its faces. deviation, error: what a solid may be off by, as
    `ConvexFit` has it.
    """
    body = _Body.of(hull)
    best = []
    for kind in kinds:
        nearest: ConvexFit | None = None
        for field, pose in _candidates(body, kind, mode):
            worst = error if nearest is None else nearest.volume_error_ratio
            fit = _measured(body, field, pose, mode, deviation, worst)
            if fit is not None and (nearest is None or fit.volume_error_ratio < worst):
                nearest = fit
        if nearest is not None:
            best.append(nearest)
    return sorted(best, key=lambda fit: fit.volume_error_ratio)


def support(field: Field, directions: np.ndarray) -> np.ndarray:
    """(N,) support of a native solid in its own frame, along unit directions (N, 3)."""
    across, along = np.linalg.norm(directions[:, :2], axis=1), np.abs(directions[:, 2])
    match field:
        case Box(size=size):
            return np.abs(directions) @ np.array(size) / 2
        case Cylinder(radius=radius, height=height):
            return radius * across + height / 2 * along
        case Capsule(radius=radius, height=height):
            return radius + height / 2 * along
        case Sphere(radius=radius):
            return np.full(len(directions), radius)
        case Ellipsoid(radii=radii):
            return np.linalg.norm(directions * np.array(radii), axis=1)
    raise AssertionError(f"{field.kind} has no support here")


def volume(field: Field) -> float:
    """Of a native solid."""
    match field:
        case Box(size=(x, y, z)):
            return x * y * z
        case Cylinder(radius=radius, height=height):
            return math.pi * radius**2 * height
        case Capsule(radius=radius, height=height):
            return math.pi * radius**2 * (height + 4 / 3 * radius)
        case Sphere(radius=radius):
            return 4 / 3 * math.pi * radius**3
        case Ellipsoid(radii=(x, y, z)):
            return 4 / 3 * math.pi * x * y * z
    raise AssertionError(f"{field.kind} has no volume here")


def _measured(
    body: _Body, field: Field, pose: Similarity, mode: Mode, most: float, worst: float
) -> ConvexFit | None:
    """With its size and place as the mode asks for; None for one that deviates more than `most`, or whose
    volume error is more than `worst`, which is measured last: it costs most."""
    turn = pose.matrix()[:3, :3]
    if mode == "within":
        room = body.offsets - body.normals @ np.array(pose.translation)
        if (room <= 0).any():
            return None
        field = field.scaled((1 - _MARGIN) * float((room / support(field, body.normals @ turn)).min()))
    error = abs(volume(field) / body.volume - 1)  # all that it is off by where one contains the other
    if error > worst:
        return None
    directions, reach = body.supports
    own = support(field, directions @ turn) + directions @ np.array(pose.translation)
    deviation = float(np.abs(own - reach).max())
    if deviation > most:
        return None
    if mode == "nearest" and (error := _volume_error(body, field, pose)) > worst:
        return None
    return ConvexFit(Part(field, pose.translation, pose.rotation), error, deviation)


@lru_cache(maxsize=1)
def _directions() -> np.ndarray:
    """(N, 3) spread evenly over the sphere."""
    i = np.arange(_DIRECTIONS) + 0.5
    z, turn = 1 - 2 * i / _DIRECTIONS, math.pi * (1 + 5**0.5) * i
    flat = np.sqrt(1 - z**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), z])


def _volume_error(body: _Body, field: Field, pose: Similarity) -> float:
    """Volume in one of the two only over the hull's: both volumes are known, what they share is measured on a
    lattice whose cells count by how much of them is inside."""
    points, cell, first = body.lattice
    held = np.flatnonzero(first)  # others share nothing
    own = field(pose.inverse()(points[held]).astype(np.float32)).astype(np.float64)
    shared = np.zeros(len(first))
    shared[held] = np.minimum(first[held], np.clip(0.5 - own / cell, 0, 1))
    return max(1 + volume(field) / body.volume - 2 * float(shared.sum() / first.sum()), 0.0)


def _candidates(body: _Body, kind: type[Field], mode: Mode) -> Iterator[tuple[Field, Similarity]]:
    maker = _AROUND[kind] if mode == "around" else _BY_MOMENTS[kind]
    if mode == "within" and kind in LARGEST:
        maker = partial(_largest, kind)
    if kind is Sphere or (kind is Ellipsoid and mode == "around"):
        yield maker(body, np.eye(3))
        return
    axes = (2,) if kind is Box or kind is Ellipsoid else (0, 1, 2)
    for frame in body.frames:
        for axis in axes:
            yield maker(body, np.roll(frame, 2 - axis, axis=1))


def _smallest_box(body: _Body) -> np.ndarray:
    """Axes of the smallest box of those with a face along one of the largest faces of the polytope."""
    best, chosen = np.inf, np.eye(3)
    normals = body.normals
    if len(normals) > _TRIED:
        normals = normals[np.linspace(0, len(normals) - 1, _TRIED).astype(int)]
    across = crosses(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    across = np.array([u / np.linalg.norm(u) for u in across])
    for normal, u, v in zip(normals, across, crosses(normals, across), strict=True):
        turn, area = _smallest_rectangle(body.corners @ np.column_stack([u, v]))
        height = float(np.ptp(body.corners @ normal))
        if area * height < best:
            best = area * height
            first = np.cos(turn) * u + np.sin(turn) * v
            chosen = np.column_stack([first, np.cross(normal, first), normal])
    return chosen


def _smallest_rectangle(points: np.ndarray) -> tuple[float, float]:
    """Turn and area of the smallest rectangle around points (N, 2): a side lies along an edge of their
    hull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        ring = points[ConvexHull(points).vertices]
    except QhullError:
        return 0.0, float(np.prod(np.ptp(points, axis=0)))
    edges = following(ring) - ring
    turns = np.arctan2(edges[:, 1], edges[:, 0])
    cosine, sine = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x, y = ring[:, 0], ring[:, 1]
    area = np.ptp(cosine * x + sine * y, axis=1) * np.ptp(cosine * y - sine * x, axis=1)
    return float(turns[area.argmin()]), float(area.min())


def _placed(frame: np.ndarray, centre: np.ndarray) -> Similarity:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = frame, centre
    return Similarity.from_matrix(matrix)


def _extent(body: _Body, frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    local = body.corners @ frame
    return local.min(axis=0), local.max(axis=0)


def _box_around(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    low, high = _extent(body, frame)
    x, y, z = ((1 + _MARGIN) * (high - low)).tolist()
    return Box((x, y, z)), _placed(frame, frame @ ((low + high) / 2))


def _cylinder_around(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    low, high = _extent(body, frame)
    middle, radius = smallest_ball((body.corners @ frame)[:, :2])
    centre = np.array([*middle, (low[2] + high[2]) / 2])
    return Cylinder((1 + _MARGIN) * radius, (1 + _MARGIN) * float(high[2] - low[2])), _placed(
        frame, frame @ centre
    )


def _capsule_around(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    """The caps begin as near to the middle as the corners beyond them allow."""
    local = body.corners @ frame
    middle, radius = smallest_ball(local[:, :2])
    radius *= 1 + _MARGIN
    room = np.sqrt(np.maximum(radius**2 - ((local[:, :2] - middle) ** 2).sum(axis=1), 0))
    low, high = float((local[:, 2] + room).min()), float((local[:, 2] - room).max())
    if high <= low:  # a ball would do; a capsule has a length
        low = high = (low + high) / 2
    height = max(high - low, 1e-6 * radius)
    return Capsule(radius, height), _placed(frame, frame @ np.array([*middle, (low + high) / 2]))


def _sphere_around(body: _Body, _: np.ndarray) -> tuple[Field, Similarity]:
    centre, radius = smallest_ball(body.corners)
    return Sphere((1 + _MARGIN) * radius), _placed(np.eye(3), centre)


def _ellipsoid_around(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    """The smallest one, whatever the frame, by Khachiyan's algorithm; grown until every corner is within."""
    points = body.corners
    lifted = np.column_stack([points, np.ones(len(points))])
    weight = np.full(len(points), 1 / len(points))
    for _ in range(_ROUNDS):
        inverse = np.linalg.inv((lifted * weight[:, None]).T @ lifted)
        far = np.einsum("ij,jk,ik->i", lifted, inverse, lifted)
        worst = int(far.argmax())
        step = (far[worst] - 4) / (4 * (far[worst] - 1))
        weight *= 1 - step
        weight[worst] += step
        if step < 1e-3:
            break
    centre = weight @ points
    spread = (points * weight[:, None]).T @ points - np.outer(centre, centre)
    variance, axes = np.linalg.eigh(spread)
    axes *= [1, 1, np.sign(np.linalg.det(axes))]
    radii = np.sqrt(3 * np.maximum(variance, 1e-12 * variance.max()))
    reach = float(np.linalg.norm((points - centre) @ axes / radii, axis=1).max()) * (1 + _MARGIN)
    x, y, z = (reach * radii).tolist()
    return Ellipsoid((x, y, z)), _placed(axes, centre)


def _largest(kind: type[Field], body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    field, centre = largest_within(kind, frame, body.normals, body.offsets, body.centre)
    return field, _placed(frame, centre)


def _local_spread(body: _Body, frame: np.ndarray) -> np.ndarray:
    return np.maximum(np.diag(frame.T @ body.spread @ frame), 1e-18)


def _box_by_moments(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    x, y, z = np.sqrt(12 * _local_spread(body, frame)).tolist()
    return Box((x, y, z)), _placed(frame, body.centre)


def _cylinder_by_moments(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    v = _local_spread(body, frame)
    return Cylinder(math.sqrt(2 * (v[0] + v[1])), math.sqrt(12 * v[2])), _placed(frame, body.centre)


def _capsule_by_moments(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    """The radius from the moments across, the length from the volume."""
    v = _local_spread(body, frame)
    radius = math.sqrt(2.1 * (v[0] + v[1]))
    height = body.volume / (math.pi * radius**2) - 4 / 3 * radius
    return Capsule(radius, max(height, 1e-6 * radius)), _placed(frame, body.centre)


def _sphere_by_moments(body: _Body, _: np.ndarray) -> tuple[Field, Similarity]:
    return Sphere(math.cbrt(body.volume * 3 / (4 * math.pi))), _placed(np.eye(3), body.centre)


def _ellipsoid_by_moments(body: _Body, frame: np.ndarray) -> tuple[Field, Similarity]:
    x, y, z = np.sqrt(5 * _local_spread(body, frame)).tolist()
    return Ellipsoid((x, y, z)), _placed(frame, body.centre)


_Maker = Callable[[_Body, np.ndarray], tuple[Field, Similarity]]
_AROUND: dict[type[Field], _Maker] = {
    Box: _box_around,
    Cylinder: _cylinder_around,
    Capsule: _capsule_around,
    Sphere: _sphere_around,
    Ellipsoid: _ellipsoid_around,
}
_BY_MOMENTS: dict[type[Field], _Maker] = {
    Box: _box_by_moments,
    Cylinder: _cylinder_by_moments,
    Capsule: _capsule_by_moments,
    Sphere: _sphere_by_moments,
    Ellipsoid: _ellipsoid_by_moments,
}
