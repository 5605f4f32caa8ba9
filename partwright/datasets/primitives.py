"""Poses of single parts: the cuboid and the cylinder that fit a part's convex hull best (PartSDF, B.4).

Both are fitted by Chamfer distance between samples of the hull and of the primitive. Each step holds the
pairs of nearest points and solves for place, turn and half-lengths in the least squares sense.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.datasets.poses import Poses
from partwright.shapes.sampling import sample_triangles

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

CUBOID, CYLINDER = "cuboid", "cylinder"
THINNEST = 0.005  # half-lengths of flat parts, unit frame
_HULL_POINTS, _PRIMITIVE_SIDE = 600, 9
_STEPS, _STILL = 30, 1e-5

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PrimitiveFit:
    """A primitive in place. kind: CUBOID or CYLINDER (its axis is z); rotation (3, 3) local to world;
    translation (3,); scale (3,) half-lengths, a cylinder's radius twice; chamfer: squared, both ways."""

    kind: str
    rotation: Array
    translation: Array
    scale: Array
    chamfer: float

    def pose(self) -> Poses:
        """As one row."""
        from scipy.spatial.transform import Rotation

        x, y, z, w = Rotation.from_matrix(self.rotation).as_quat()
        turn = np.array([w, x, y, z]) if w >= 0 else -np.array([w, x, y, z])
        rows = (array[None].astype(np.float32) for array in (self.translation, turn, self.scale))
        return Poses(*rows)

    def to_row(self) -> list[Any]:
        """For JSON."""
        numbers = [self.rotation, self.translation, self.scale]
        return [self.kind, *(array.tolist() for array in numbers), self.chamfer]

    @classmethod
    def from_row(cls, row: list[Any]) -> PrimitiveFit:
        """The fit of `to_row`."""
        kind, rotation, translation, scale, chamfer = row
        return cls(kind, np.array(rotation), np.array(translation), np.array(scale), chamfer)


def fit_primitives(vertices: Array, seed: int = 0) -> list[PrimitiveFit]:
    """Four fits to a part's vertices (V, 3): each kind from the world's axes and from the tightest box.

    Two starts, because a part that stands straight should not be turned for little, and one that is tilted
    is not found from straight.
    """
    from scipy.spatial import cKDTree

    corners, samples = _hull(vertices, seed)
    tree = cKDTree(samples)
    fits = []
    for rotation in (np.eye(3), _tightest_box(corners)):
        fits.append(_refined(_box_of(CUBOID, samples, rotation), samples, tree))
        upright = [_box_of(CYLINDER, samples, rotation @ turn) for turn in _AXES_TO_Z]
        best = min(upright, key=lambda fit: _chamfer(fit, samples, tree))
        fits.append(_refined(best, samples, tree))
    return fits


# z stays, x becomes z, y becomes z.
_AXES_TO_Z = tuple(np.roll(np.eye(3), shift, axis=1) for shift in range(3))


def _hull(vertices: Array, seed: int) -> tuple[Array, Array]:
    """Corners (C, 3) and samples (N, 3) of the convex hull; flat parts are joggled into one (Qhull's QJ)."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(vertices, qhull_options="QJ")
    samples, _ = sample_triangles(vertices, hull.simplices.astype(np.int64), _HULL_POINTS, seed)
    return vertices[hull.vertices], samples


def _tightest_box(corners: Array) -> Array:
    """Axes (3, 3), columns, of the box of least surface that has a side along an edge of the principal frame.

    The principal axes, turned about each in turn to where the rectangle around the hull's outline is least.
    """
    centred = corners - corners.mean(axis=0)
    rotation = np.linalg.svd(centred, full_matrices=False)[2].T
    rotation[:, 2] = np.cross(rotation[:, 0], rotation[:, 1])
    for axis in (0, 1, 2, 0, 1, 2):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        flat = centred @ rotation
        angles = np.radians(np.arange(-45, 45, 1.0))
        along = np.outer(np.cos(angles), flat[:, u]) + np.outer(np.sin(angles), flat[:, v])
        across = np.outer(np.cos(angles), flat[:, v]) - np.outer(np.sin(angles), flat[:, u])
        area = np.ptp(along, axis=1) * np.ptp(across, axis=1)
        angle = angles[area.argmin()]
        turned_u = np.cos(angle) * rotation[:, u] + np.sin(angle) * rotation[:, v]
        turned_v = np.cos(angle) * rotation[:, v] - np.sin(angle) * rotation[:, u]
        rotation[:, u], rotation[:, v] = turned_u, turned_v
    return rotation


def _box_of(kind: str, points: Array, rotation: Array) -> PrimitiveFit:
    """The primitive around the points that is turned like this."""
    local = points @ rotation
    low, high = local.min(axis=0), local.max(axis=0)
    scale = np.maximum((high - low) / 2, THINNEST)
    if kind == CYLINDER:
        scale[:2] = scale[:2].mean()
    return PrimitiveFit(kind, rotation, rotation @ ((low + high) / 2), scale, np.inf)


def _refined(start: PrimitiveFit, samples: Array, tree: cKDTree) -> PrimitiveFit:
    """The best of the steps from `start`."""
    best = last = None
    for fit in _steps(start, samples, tree):
        if best is None or fit.chamfer < best.chamfer:
            best = fit
        if last is not None and _moved(last, fit) < _STILL:
            break
        last = fit
    assert best is not None
    return best


def _moved(one: PrimitiveFit, other: PrimitiveFit) -> float:
    """By how much the corners' frame has moved, at most."""
    turned = np.abs(other.rotation * other.scale - one.rotation * one.scale).max()
    return float(max(turned, np.abs(other.translation - one.translation).max()))


def _steps(start: PrimitiveFit, samples: Array, tree: cKDTree) -> Iterator[PrimitiveFit]:
    """The start and each fit after it, with its Chamfer distance."""
    fit = start
    for _ in range(_STEPS):
        canonical, target, weight = _pairs(fit, samples, tree)
        residual = target - _placed(fit, canonical)
        yield replace(fit, chamfer=float((weight * (residual**2).sum(axis=1)).sum()))
        fit = _solved(fit, canonical, residual, weight)


def _chamfer(fit: PrimitiveFit, samples: Array, tree: cKDTree) -> float:
    return next(_steps(fit, samples, tree)).chamfer


def _pairs(fit: PrimitiveFit, samples: Array, tree: cKDTree) -> tuple[Array, Array, Array]:
    """Canonical points (M, 3) of the primitive, the hull's point (M, 3) that each is drawn to, weights (M,).

    Hull samples draw their nearest point of the primitive, and the primitive's samples are drawn to their
    nearest hull sample; either half weighs 1.
    """
    local = (samples - fit.translation) @ fit.rotation
    nearest = (_on_cuboid if fit.kind == CUBOID else _on_cylinder)(local, fit.scale) / fit.scale
    own, area = _samples_of(fit)
    drawn = samples[tree.query(_placed(fit, own))[1]]
    weight = np.concatenate([np.full(len(samples), 1 / len(samples)), area / area.sum()])
    return np.concatenate([nearest, own]), np.concatenate([samples, drawn]), weight


def _placed(fit: PrimitiveFit, canonical: Array) -> Array:
    return (canonical * fit.scale) @ fit.rotation.T + fit.translation


def _solved(fit: PrimitiveFit, canonical: Array, residual: Array, weight: Array) -> PrimitiveFit:
    """One Gauss-Newton step on translation, rotation vector and half-lengths."""
    from scipy.spatial.transform import Rotation

    arm = (canonical * fit.scale) @ fit.rotation.T
    columns = 9 if fit.kind == CUBOID else 8
    jacobian = np.zeros((len(arm), 3, columns))
    jacobian[:, (0, 1, 2), (0, 1, 2)] = 1.0
    for axis in range(3):  # the unit vector along it, cross the arm
        after, last = (axis + 1) % 3, (axis + 2) % 3
        jacobian[:, after, 3 + axis] = -arm[:, last]
        jacobian[:, last, 3 + axis] = arm[:, after]
    own = (6, 7, 8) if fit.kind == CUBOID else (6, 6, 7)  # a cylinder's radius grows along two axes
    for axis, column in enumerate(own):
        jacobian[:, :, column] += canonical[:, axis, None] * fit.rotation[:, axis]
    rows = jacobian.reshape(-1, columns)
    weighted = (rows * np.repeat(weight, 3)[:, None]).T
    normal = weighted @ rows
    # A cylinder's turn about its axis moves nothing; a little damping keeps the system solvable.
    normal[np.diag_indices(len(normal))] += 1e-9
    step = np.linalg.solve(normal, weighted @ residual.ravel())
    rotation = Rotation.from_rotvec(step[3:6]).as_matrix() @ fit.rotation
    change = step[6:] if fit.kind == CUBOID else step[[6, 6, 7]]
    scale = np.maximum(fit.scale + change, THINNEST)
    return PrimitiveFit(fit.kind, rotation, fit.translation + step[:3], scale, np.inf)


def _on_cuboid(local: Array, scale: Array) -> Array:
    """Nearest points (N, 3) of the surface of the box |x| <= scale."""
    clamped = np.clip(local, -scale, scale)
    inside = (np.abs(local) < scale).all(axis=1)
    axis = (scale - np.abs(local[inside])).argmin(axis=1)
    rows = np.flatnonzero(inside)
    clamped[rows, axis] = np.where(local[rows, axis] < 0, -1.0, 1.0) * scale[axis]
    return clamped


def _on_cylinder(local: Array, scale: Array) -> Array:
    """Nearest points (N, 3) of the surface of the cylinder of radius scale[0] and half-height scale[2]."""
    radius, half = scale[0], scale[2]
    distance = np.maximum(np.linalg.norm(local[:, :2], axis=1), 1e-12)
    outward = local[:, :2] / distance[:, None]
    reach, height = np.minimum(distance, radius), np.clip(local[:, 2], -half, half)
    inside = (distance < radius) & (np.abs(local[:, 2]) < half)
    to_cap = inside & (half - np.abs(local[:, 2]) < radius - distance)
    height = np.where(to_cap, np.where(local[:, 2] < 0, -half, half), height)
    reach = np.where(inside & ~to_cap, radius, reach)
    return np.column_stack([outward * reach[:, None], height])


def _samples_of(fit: PrimitiveFit) -> tuple[Array, Array]:
    """Canonical samples (M, 3) of the surface and the area (M,) that each stands for."""
    x, _, z = fit.scale
    if fit.kind == CUBOID:
        points, face = _cuboid_grid()
        area = np.array([fit.scale[1] * z, x * z, x * fit.scale[1]])
        return points, area[face]
    points, face, share = _cylinder_grid()
    return points, share * np.array([2 * x * z, x * x])[face]


@cache
def _cuboid_grid() -> tuple[Array, NDArray[np.int64]]:
    """Cell centres on the six faces of [-1, 1]^3, and the axis that each face is square to."""
    step = (np.arange(_PRIMITIVE_SIDE) + 0.5) / _PRIMITIVE_SIDE * 2 - 1
    u, v = (a.ravel() for a in np.meshgrid(step, step))
    faces = [np.insert(np.column_stack([u, v]), axis, side, axis=1) for axis in range(3) for side in (-1, 1)]
    return np.concatenate(faces), np.repeat(np.arange(3), 2 * len(u))


@cache
def _cylinder_grid() -> tuple[Array, NDArray[np.int64], Array]:
    """Points on the cylinder of radius and half-height 1, whether each is on the side (0) or a cap (1), and
    its share of that."""
    turn = np.arange(24) / 24 * 2 * np.pi
    step = (np.arange(_PRIMITIVE_SIDE) + 0.5) / _PRIMITIVE_SIDE
    t, z = (a.ravel() for a in np.meshgrid(turn, 2 * step - 1))
    side = np.column_stack([np.cos(t), np.sin(t), z])
    t, r = (a.ravel() for a in np.meshgrid(turn, step))
    cap = np.column_stack([r * np.cos(t), r * np.sin(t), np.ones(len(t))])
    points = np.concatenate([side, cap, cap * (1, 1, -1)])
    # Rings of a cap grow with their radius; both caps share the area of two discs.
    share = np.concatenate([np.full(len(side), 1 / len(side)), r / r.sum() / 2, r / r.sum() / 2])
    return points, np.repeat([0, 1], [len(side), 2 * len(cap)]), share
