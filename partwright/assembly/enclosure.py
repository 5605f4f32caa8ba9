"""Where an assembly of quadrics lies: a convex polytope around it, found by cutting a huge box down.

The box around each leaf says little where leaves are half-spaces. Instead each leaf of an intersection cuts
the polytope that the others have left: a plane by itself, a curved quadric by the slabs it cannot leave.
Every cut is safe, so the polytope always holds the solid; for planes alone it is the solid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.placed import placed_quadric
from partwright.fields import Quadric

if TYPE_CHECKING:
    from manifold3d import Manifold

    from partwright.assembly.tree import Node, Part

_HUGE = 1e4  # half the first box, in units of how far the leaves are from its middle
_ROUNDS = 4
_WORTH = 1e-9  # of the polytope's size: cuts that take less are not made
_AXES = np.vstack([-np.eye(3), np.eye(3)])


def enclosing_box(node: Node, level: float = 0.0) -> np.ndarray:
    """(2, 3) a box around where the node's distance is below `level`; infinite where the node does not end.

    A node with nothing inside gets a box without size.
    """
    from manifold3d import Manifold

    parts = tuple(copy for part in node.parts for copy in part.copies)
    middle, reach = _about(parts)
    half = _HUGE * (reach + level)
    start = Manifold.cube((2 * half,) * 3, True).translate(tuple(middle))
    corners = _corners(_cut_by(node, start, level))
    if not len(corners):
        return np.array([middle, middle])
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    return np.where(np.abs(box - middle) >= half * (1 - 1e-6), [[-np.inf], [np.inf]], box)


def _about(parts: tuple[Part, ...]) -> tuple[np.ndarray, float]:
    """A point (3,) in the midst of the leaves, and how far from it their surfaces or bounds reach."""
    finite = [part.bounds() for part in parts]
    finite = [box for box in finite if np.isfinite(box).all()]
    places = [np.mean(box, axis=0) for box in finite] + [np.array(part.translation) for part in parts]
    middle = np.mean(places, axis=0)
    distances = [_reach(placed, middle) for part in parts if (placed := placed_quadric(part)) is not None]
    corners = [float(np.abs(box - middle).max()) for box in finite]
    spread = [float(np.abs(place - middle).max()) for place in places]
    return middle, max([*distances, *corners, *spread]) or 1.0


def _reach(quadric: Quadric, point: np.ndarray) -> float:
    """About how far off the surface is: along the gradient, or by the curvature where that is nearer."""
    value = abs(float(quadric.polynomial(point[None])[0]))
    slope = float(np.linalg.norm(quadric.gradient(point[None])[0]))
    curvature = float(np.abs(np.linalg.eigvalsh(quadric.matrices()[0])).max())
    ways = [value / slope if slope else np.inf, np.sqrt(value / curvature) if curvature else np.inf]
    return float(min(ways)) if np.isfinite(ways).any() else 0.0


def _cut_by(node: Node, region: Manifold, level: float) -> Manifold:
    """What of a convex region may be inside the node, as a convex region."""
    from manifold3d import Manifold

    if node.is_part and not node.instances:
        return _cut_by_part(node, region, level)
    children = node.operands
    if node.operation == "difference":
        return _cut_by(children[0], region, level)
    if node.operation == "union":
        grown = [level + child.blend / 2 for child in children]
        return Manifold.batch_hull(
            [_cut_by(child, region, more) for child, more in zip(children, grown, strict=True)]
        )
    for _ in range(_ROUNDS):
        volume = region.volume()
        for child in children:
            region = _cut_by(child, region, level)
        if region.is_empty() or region.volume() > 0.99 * volume:
            break
    return region


def _cut_by_part(part: Part, region: Manifold, level: float) -> Manifold:
    quadric, corners = placed_quadric(part), _corners(region)
    if quadric is None:
        box = part.bounds() + level * np.array([[-1.0], [1.0]])
        return _trimmed(region, _AXES, np.concatenate([-box[0], box[1]]))
    if not len(corners):
        return region
    square, linear, constant = quadric.matrices()
    if level:  # f <= |grad f| level + k level^2, the gradient's length being largest at a corner
        steepest = float(np.linalg.norm(quadric.gradient(corners), axis=1).max())
        bend = max(0.0, -float(np.linalg.eigvalsh(square).min()))
        constant -= steepest * level + bend * level**2
        quadric = Quadric.from_matrices(square, linear, constant)
    reach = quadric.support(_AXES)
    finite = np.isfinite(reach)
    if np.isneginf(reach).any():
        return type(region)()
    region = _trimmed(region, _AXES[finite], reach[finite])
    return _trimmed_by_slabs(_trimmed_by_tangent(region, quadric), quadric)


def _trimmed_by_tangent(region: Manifold, quadric: Quadric) -> Manifold:
    """f >= f0 + grad f0 . (p - p0) - k |p - p0|^2 for a least curvature of -k < 0."""
    corners = _corners(region)
    if not len(corners):
        return region
    foot = _foot(quadric, corners)
    normal = quadric.gradient(foot[None])[0]
    length = float(np.linalg.norm(normal))
    if length == 0:
        return region
    bend = max(0.0, -float(np.linalg.eigvalsh(quadric.matrices()[0]).min()))
    slack = bend * float(((corners - foot) ** 2).sum(axis=1).max()) - float(quadric.polynomial(foot[None])[0])
    return _trimmed(region, normal[None] / length, np.array([normal @ foot + slack]) / length)


def _foot(quadric: Quadric, corners: np.ndarray) -> np.ndarray:
    """A point of the surface (3,), or near it, by steps along the gradient from the middle of the corners.

    Not beyond their box: where there is no surface the steps would go so far off that nothing but rounding
    is left of the bound.
    """
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    point = np.asarray(corners.mean(axis=0))
    for _ in range(8):
        slope = quadric.gradient(point[None])[0]
        square = float(slope @ slope)
        if square == 0:
            break
        step = slope * float(quadric.polynomial(point[None])[0]) / square
        point = np.clip(point - step, lower, upper)
    return point


def _trimmed_by_slabs(region: Manifold, quadric: Quadric) -> Manifold:
    """Along each principal axis, with the least that the other axes can add to f."""
    square, linear, constant = quadric.matrices()
    curvature, axes = np.linalg.eigh(square)
    slope = linear @ axes
    for i in np.flatnonzero((curvature > 0) | (slope != 0)):
        corners = _corners(region)
        if not len(corners):
            return region
        least = _least(curvature, slope, (corners @ axes).min(axis=0), (corners @ axes).max(axis=0))
        left = -constant - float(least.sum() - least[i])
        low, high = _solutions(float(curvature[i]), float(slope[i]), left)
        if low > high:
            return type(region)()
        normals, reach = np.stack([axes[:, i], -axes[:, i]]), np.array([high, -low])
        region = _trimmed(region, normals[np.isfinite(reach)], reach[np.isfinite(reach)])
    return region


def _least(curvature: np.ndarray, slope: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(3,) smallest curvature s^2 + slope s for s in [low, high], each axis by itself."""
    ends = np.minimum((curvature * low + slope) * low, (curvature * high + slope) * high)
    bottom = -slope / (2 * np.where(curvature > 0, curvature, 1.0))
    within = (curvature > 0) & (bottom > low) & (bottom < high)
    return np.where(within, slope * bottom / 2, ends)


def _solutions(curvature: float, slope: float, left: float) -> tuple[float, float]:
    """The interval of s with curvature s^2 + slope s <= left; an axis that curves down has no bound."""
    if curvature < 0:
        return -np.inf, np.inf
    if curvature == 0:
        return (-np.inf, left / slope) if slope > 0 else (left / slope, np.inf)
    inner = slope**2 + 4 * curvature * left
    if inner < 0:
        return np.inf, -np.inf
    q = -(slope + np.copysign(np.sqrt(inner), slope)) / 2
    ends = (q / curvature, -left / q if q else 0.0)
    return min(ends), max(ends)


def _trimmed(region: Manifold, normals: np.ndarray, reach: np.ndarray) -> Manifold:
    """The region where normal . p <= reach, for each row; cuts that take next to nothing are skipped."""
    for normal, far in zip(normals, reach, strict=True):
        corners = _corners(region)
        if not len(corners):
            break
        beyond = float((corners @ normal).max()) - far
        if beyond > _WORTH * float(np.ptp(corners, axis=0).max()):
            region = region.trim_by_plane(tuple((-normal).tolist()), -float(far))
    return region


def _corners(region: Manifold) -> np.ndarray:
    return np.asarray(region.to_mesh64().vert_properties, dtype=np.float64)[:, :3]
