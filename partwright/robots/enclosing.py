"""Convex solids that contain triangles exactly, each the pieces of them that it covers.

A triangle lies within a convex solid where its corners do. One that runs from one solid into another is cut
in two until each piece lies in one of them, or hardly out of it; such a piece then joins that solid, which
becomes the hull of both. So every point of every triangle is in the hull of the corners of a piece: contained
by construction, with nothing grown that had no need to.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.hull_faces import beyond_faces, faces_of
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_Planes = tuple[np.ndarray, np.ndarray]  # normals (F, 3) and offsets (F,)
_FINEST = 4  # times `fine`: edges of pieces that join the nearest solid however far it is
_ASKED = 32  # planes whose distances are measured at once
_AROUND = np.array([way for way in np.ndindex(3, 3, 3) if way != (1, 1, 1)], float) - 1
_MOST = 400_000  # pieces that are cut further; more join where they are


def containing(hulls: Sequence[Manifold], triangles: np.ndarray, fine: float) -> list[Manifold]:
    """The hulls, each enlarged by the pieces of triangles (T, 3, 3) that stick out of all of them and are
    nearest to it.

    fine: a length; how far a piece may stick out of a hull before it is cut.
    """
    planes = [faces_of(hull) for hull in hulls]
    boxes = [np.reshape(hull.bounding_box(), (2, 3)) for hull in hulls]
    joining: list[list[np.ndarray]] = [[surface_of(hull)[0]] for hull in hulls]
    changed = np.zeros(len(hulls), bool)
    left = triangles
    while len(left := left[~_within_one(planes, boxes, left)]):
        owner, beyond = nearest_hulls(planes, left)
        edges = np.linalg.norm(left - np.roll(left, 1, axis=1), axis=2)
        small = (edges.max(axis=1) <= _FINEST * fine) | (len(left) > _MOST)
        joins = (beyond <= fine) | small
        for i in np.unique(owner[joins]):
            joining[i].append(left[joins & (owner == i)].reshape(-1, 3))
            changed[i] = True
        left = halves(left[~joins], edges[~joins].argmax(axis=1))
    return [
        hull_of(np.concatenate(points)) if more else hull
        for hull, points, more in zip(hulls, joining, changed, strict=True)
    ]


def outer_hull(hull: Manifold, by: float, most: int, room: float, farthest: float = np.inf) -> Manifold:
    """A convex solid of few faces that contains another one.

    Of the other's face planes those first that cut off most, each moved out by `room`: until no corner is
    farther than `by` out of any plane, or there are `most` of them and none is farther than `farthest`.
    Lengths.
    """
    from manifold3d import Manifold

    corners = surface_of(hull)[0]
    normals, offsets = faces_of(hull)
    offsets = offsets + room
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    size = float((upper - lower).max())
    result = Manifold.cube(tuple((upper - lower + 2 * size).tolist())).translate(
        tuple((lower - size).tolist())
    )  # so large that none of its own faces is left
    excess = np.full(len(normals), np.inf)  # at most: what was cut off since is not counted
    for count in range(len(normals)):
        corners, known = surface_of(result)[0], np.zeros(len(normals), bool)
        while not known[worst := int(excess.argmax())]:
            most_far = np.argpartition(-excess, min(_ASKED, len(excess) - 1))[:_ASKED]
            excess[most_far] = (corners @ normals[most_far].T - offsets[most_far]).max(axis=0)
            known[most_far] = True
        if excess[worst] <= by or (count >= most and excess[worst] <= farthest):
            break
        result = result.trim_by_plane(tuple((-normals[worst]).tolist()), -float(offsets[worst]))
    return result


def nearest_hulls(planes: Sequence[_Planes], triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T,) the hull that each triangle is least outside of, and by how much; some planes of a hull tell
    whether all of them need to be asked."""
    least = np.stack([corners_beyond(_some(each), triangles).max(axis=1) for each in planes])
    owner, beyond = least.argmin(axis=0), np.full(len(triangles), np.inf)
    for turn in (True, False):
        for i, each in enumerate(planes):
            asked = np.flatnonzero(owner == i if turn else (least[i] < beyond))
            found = corners_beyond(each, triangles[asked]).max(axis=1)
            nearer = found < beyond[asked]
            owner[asked[nearer]], beyond[asked[nearer]] = i, found[nearer]
            least[i, asked] = np.inf
    return owner, beyond


def _some(planes: _Planes) -> _Planes:
    """Those that face most into each direction of a lattice."""
    normals, offsets = planes
    chosen = np.unique((normals @ _AROUND.T).argmax(axis=0))
    return normals[chosen], offsets[chosen]


def _within_one(planes: Sequence[_Planes], boxes: Sequence[np.ndarray], triangles: np.ndarray) -> np.ndarray:
    """(T,) whether one of the hulls contains the triangle."""
    within = np.zeros(len(triangles), bool)
    lower, upper = triangles.min(axis=1), triangles.max(axis=1)
    for each, box in zip(planes, boxes, strict=True):
        near = np.flatnonzero(~within & ((lower >= box[0]) & (upper <= box[1])).all(axis=1))
        within[near] = (corners_beyond(each, triangles[near]) <= 0).all(axis=1)
    return within


def corners_beyond(planes: _Planes, triangles: np.ndarray) -> np.ndarray:
    """(T, 3) how far each corner is outside of a hull; not positive inside."""
    return beyond_faces(triangles.reshape(-1, 3), *planes).reshape(-1, 3)


def halves(triangles: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """(2 T, 3, 3) triangles cut through the middle of the edge that ends at corner `longest` (T,)."""
    rows = np.arange(len(triangles))
    start, stop, apex = (triangles[rows, (longest + k) % 3] for k in (-1, 0, 1))
    middle = (start + stop) / 2
    return np.concatenate([np.stack([start, middle, apex], 1), np.stack([middle, stop, apex], 1)])
