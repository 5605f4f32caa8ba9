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
    own: np.ndarray, whole: Hull, kept_out: Sequence[Hull], enough: float, *, further: bool
) -> list[Hull]:
    """Hulls of what is on either side of a plane, and together overlap others least; none where there is no
    plane that splits it.

    own: (T, 3, 3) triangles; whole: the hull of them, which overlaps all of kept_out. enough: an overlap;
    where more is left, and only if `further`, what is on each side is split again: the halves of a ring fill
    its hole as much as the ring does, quarters less.
    """
    cuts = _cuts(own, whole, kept_out)
    sides = _halves(own, *cuts[0][1]) if cuts else []
    if not further or overlap(sides, kept_out) <= enough:
        return sides
    return _quarters(own, kept_out, cuts[0][1]) if cuts else []


def overlap(hulls: Sequence[Hull], kept_out: Sequence[Hull]) -> float:
    """Volume that hulls share with others, each by itself."""
    return sum(hull.shares(one) for hull in hulls for one in kept_out)


def _halves(own: np.ndarray, normal: np.ndarray, offset: float) -> list[Hull]:
    return [Hull(hull_of(points)) for points in Halves.of(own).points(normal, offset)]


def _cuts(own: np.ndarray, whole: Hull, kept_out: Sequence[Hull]) -> list[tuple[float, Plane]]:
    """Planes that may split what a hull contains (T, 3, 3), with about the volume in which the hulls of both
    sides overlap others: the best first. whole: the hull of it all."""
    worst = max(kept_out, key=whole.shares)
    halves, found = Halves.of(own), []
    for plane in _planes(own, worst, whole.solid ^ worst.solid):
        sides = [Hull(hull_of(points)) for points in halves.ends(*plane)]
        if sides and all(side.volume > 0 for side in sides):
            found.append((overlap(sides, kept_out), plane))
    return sorted(found, key=lambda entry: entry[0])


def _quarters(own: np.ndarray, kept_out: Sequence[Hull], plane: Plane) -> list[Hull]:
    """Hulls of what is on either side of a plane, split once more where that overlaps others."""
    normal, offset = plane
    found = []
    for half in (side_of(own, normal, offset), side_of(own, -normal, -offset)):
        whole = Hull(hull_of(half.reshape(-1, 3)))
        cuts = _cuts(half, whole, kept_out) if overlap([whole], kept_out) > 0 else []
        found += _halves(half, *cuts[0][1]) if cuts else [whole]
    return found


def _planes(own: np.ndarray, met: Hull, both: Manifold) -> Iterator[tuple[np.ndarray, float]]:
    """Planes that may split what a hull contains (T, 3, 3) where it meets another one. both: what they share.
    Those of the other's faces and of the own triangles there, the largest first, and across that place."""
    box = np.reshape(both.bounding_box(), (2, 3))
    middle, size = box.mean(axis=0), float(np.ptp(met.box, axis=0).max())
    for axis in range(3):
        yield from ((np.eye(3)[axis], float(place)) for place in (*box[:, axis], middle[axis]))
    here = ((own.min(axis=1) <= box[1]) & (own.max(axis=1) >= box[0])).all(axis=1)
    corners, faces = surface_of(met.solid)
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
