"""A convex solid as near to one that is not quite convex as it can be: its hull, with faces moved inwards.

A hull bridges what is concave, as the chord of a ring's segment its hole. Moved inwards by the right amount
such a face adds half as much and lacks about as much: the sum of both is what counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_cover import faces_of
from partwright.approximation.convex_piece import Piece
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_FACES = 12  # of a hull, the largest, that are tried
_SHALLOWEST = 2.0**-7  # of the deepest depth
_REFINED = 4  # depths tried between the best of those that double and its neighbours
_KEPT = 0.5  # of the piece's own volume, at least
_WORTH = 5e-4  # of the piece's volume: what moves less stays


def balanced_hull(piece: Piece, deepest: float) -> Manifold:
    """The hull of a piece with those faces moved inwards, by a length of `deepest` at most, where that adds
    less than it takes."""
    solid, hull = piece.solid, piece.hull
    own = solid.volume()
    if piece.extra <= _WORTH * own:
        return hull
    extra = hull - solid
    for normal, offset in zip(*_large_faces(hull), strict=True):
        if extra.volume() <= _WORTH * own:
            break
        face = _Face(tuple((-normal).tolist()), float(offset), solid, extra, _KEPT * own)
        depth, gain = _deepest(face.gain, deepest)
        if gain > _WORTH * own:
            hull, solid, extra = (face.trimmed(one, depth) for one in (hull, solid, extra))
    return hull


@dataclass(frozen=True)
class _Face:
    """One that may move inwards. extra: what the hull adds to the solid; kept: volume that has to stay."""

    inward: tuple[float, ...]
    offset: float
    solid: Manifold
    extra: Manifold
    kept: float

    def trimmed(self, solid: Manifold, depth: float) -> Manifold:
        return solid.trim_by_plane(self.inward, depth - self.offset)

    def gain(self, depth: float) -> float:
        """Volume that is no longer added, less what is lost."""
        left = self.trimmed(self.solid, depth).volume()
        gone = self.extra.volume() - self.trimmed(self.extra, depth).volume()
        return float(gone - (self.solid.volume() - left)) if left >= self.kept else -np.inf


def _deepest(gain: Callable[[float], float], deepest: float) -> tuple[float, float]:
    """The depth that gains most, and what it gains; gains rise up to it and fall beyond, but for steps."""
    tried = {0.0: 0.0}
    depth = deepest * _SHALLOWEST
    while depth <= deepest:
        tried[depth] = gain(depth)
        if tried[depth] < min(max(tried.values()), 0.0) or np.isneginf(tried[depth]):
            break
        depth *= 2
    for _ in range(_REFINED):
        known = sorted(tried)
        at = known.index(max(tried, key=lambda one: tried[one]))
        sides = [(known[i], known[i + 1]) for i in (at - 1, at) if 0 <= i < len(known) - 1]
        low, high = max(sides, key=lambda side: side[1] - side[0])
        tried[(low + high) / 2] = gain((low + high) / 2)
    chosen = max(tried, key=lambda one: tried[one])
    return chosen, tried[chosen]


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
