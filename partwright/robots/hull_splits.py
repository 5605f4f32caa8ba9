"""Hulls split in two or four, so that they overlap others less."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of
from partwright.robots.enclosed_link import Hull
from partwright.robots.triangles import Halves, side_of
from partwright.shapes.topology import area_vectors

if TYPE_CHECKING:
    from manifold3d import Manifold

_TRIED = 6  # planes of either that may split a hull
_SAME = 1e-3  # normals, and offsets over the size, of planes that are tried once

Plane = tuple[np.ndarray, float]


def best_sides(
    own: np.ndarray, whole: Hull, kept_out: Manifold, enough: float, *, further: bool
) -> list[Hull]:
    """Hulls of what is on either side of a plane, and together overlap others least; none where no plane
    leaves less than enough.

    own: (T, 3, 3) triangles; whole: the hull of them, which overlaps kept_out. enough: an overlap; where more
    is left, and only if `further`, what is on each side is split again: the halves of a ring fill its hole as
    much as the ring does, quarters less.
    """
    halves, shared = Halves.of(own), whole.solid ^ kept_out
    cuts = _cuts(own, halves, shared)
    sides = _best(halves, cuts, shared, enough)
    return _quarters(own, cuts[0][1], shared) if cuts and further and not sides else sides


def overlap(hulls: Sequence[Hull], kept_out: Manifold) -> float:
    """Volume that hulls share with a solid, each by itself."""
    return sum(float((hull.solid ^ kept_out).volume()) for hull in hulls)


def _cuts(own: np.ndarray, halves: Halves, shared: Manifold) -> list[tuple[float, Plane]]:
    """Planes that may split what a hull contains (T, 3, 3), the best first, with a volume: the hulls of both
    sides overlap others by no less. shared: what the hull of it all does."""
    found = []
    for plane in _planes(own, shared):
        sides = [Hull(hull_of(points)) for points in halves.ends(*plane)]
        if sides and all(side.volume > 0 for side in sides):
            found.append((overlap(sides, shared), plane))
    return sorted(found, key=lambda entry: entry[0])


def _best(halves: Halves, cuts: Sequence[tuple[float, Plane]], shared: Manifold, enough: float) -> list[Hull]:
    """The hulls of both sides of the plane that leaves least, of those that leave less than enough."""
    found: list[Hull] = []
    for least, plane in cuts:
        if least >= enough:
            break
        sides, left = [], 0.0
        for points in sorted(halves.points(*plane), key=len, reverse=True):
            sides.append(Hull(hull_of(points)))
            left += overlap(sides[-1:], shared)
            if left >= enough:
                break
        else:
            enough, found = left, sides
    return found


def _quarters(own: np.ndarray, plane: Plane, shared: Manifold) -> list[Hull]:
    """Hulls of what is on either side of a plane, split once more where that overlaps others."""
    normal, offset = plane
    found = []
    for half in (side_of(own, normal, offset), side_of(own, -normal, -offset)):
        whole = Hull(hull_of(half.reshape(-1, 3)))
        left = overlap([whole], shared)
        sides = best_sides(half, whole, shared, left, further=False) if left > 0 else []
        found += sides or [whole]
    return found


def _planes(own: np.ndarray, shared: Manifold) -> Iterator[Plane]:
    """Planes that may split what a hull contains (T, 3, 3), where that shares volume with others: across that
    place along the axes; those of its faces and of the own triangles there, the largest first."""
    corners, faces = surface_of(shared)
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    middle, size = box.mean(axis=0), float(np.ptp(box, axis=0).max())
    for axis in range(3):
        yield from ((np.eye(3)[axis], float(place)) for place in (*box[:, axis], middle[axis]))
    here = ((own.min(axis=1) <= box[1]) & (own.max(axis=1) >= box[0])).all(axis=1)
    for triangles in (corners[faces], own[here]):
        areas = area_vectors(triangles)
        length = np.linalg.norm(areas, axis=1)
        real = length > 0
        normals = areas[real] / length[real, None]
        offsets = np.einsum("ij,ij->i", normals, triangles[real, 0])
        keys = np.round(np.column_stack([normals, (offsets - normals @ middle) / size]) / _SAME)
        _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        largest = np.argsort(-np.bincount(group.reshape(-1), length[real]), kind="stable")[:_TRIED]
        yield from ((normals[i], float(offsets[i])) for i in first[largest])
