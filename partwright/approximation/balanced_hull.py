"""A convex solid as near to one that is not quite convex as it can be: its hull, with faces moved inwards.

A hull bridges what is concave, as the chord of a ring's segment its hole. Moved inwards by the right amount
such a face adds half as much and lacks about as much: the sum of both is what counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_cover import Piece, faces_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_FACES = 8  # of a hull, the largest that bridge something
_STEPS = 6  # depths that are tried of each
_KEPT = 0.5  # of the piece's own volume, at least
_WORTH = 0.002  # of the piece's volume: bridges that add less stay


def balanced_hull(piece: Piece, deepest: float) -> Manifold:
    """The hull of a piece with those faces moved inwards, by a length of `deepest` at most, where that adds
    less than it takes."""
    solid, hull = piece.solid, piece.hull
    if piece.extra <= _WORTH * solid.volume():
        return hull
    extra = hull - solid
    normals, offsets = _large_faces(hull)
    for normal, offset in zip(normals, offsets, strict=True):
        inward = tuple((-normal).tolist())
        best, depth = _WORTH * solid.volume(), 0.0
        for step in deepest * (np.arange(_STEPS) + 1) / _STEPS:
            height = float(offset - step)
            gone = extra.volume() - extra.trim_by_plane(inward, -height).volume()
            lost = solid.volume() - solid.trim_by_plane(inward, -height).volume()
            if solid.volume() - lost < _KEPT * piece.solid.volume():
                break
            if gone - lost > best:
                best, depth = gone - lost, float(step)
            elif depth:
                break
        if depth:
            cut = -float(offset) + depth
            hull, solid, extra = (one.trim_by_plane(inward, cut) for one in (hull, solid, extra))
    return hull


def _large_faces(hull: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Normals (F, 3) and offsets (F,) of the largest faces, the largest first."""
    corners, faces = surface_of(hull)
    a, b, c = corners[faces.T]
    cross = np.cross(b - a, c - a)
    normals, offsets = faces_of(hull)
    length = np.linalg.norm(cross, axis=1)
    real = length > 0
    owner = (cross[real] / length[real, None] @ normals.T).argmax(axis=1)
    area = np.bincount(owner, length[real], minlength=len(normals))
    largest = np.argsort(-area, kind="stable")[:_FACES]
    return normals[largest], offsets[largest]
