"""A convex solid with few corners: engines collide each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_cover import faces_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_MOST = 128  # corners
_LOST = 0.01  # of the volume: what is thin keeps more corners
_FEW = 8  # corners that are taken at once


def light_hull(hull: Manifold, by: float, most: int = _MOST) -> tuple[Manifold, float]:
    """The hull of some of its corners, those added first that stick out most; and how far (a length) any of
    the others sticks out of it: no more than `by`, unless that would take more than `most` corners."""
    from manifold3d import Manifold

    corners = surface_of(hull)[0]
    if len(corners) <= _FEW:
        return hull, 0.0
    middle = corners.mean(axis=0)
    directions = np.linalg.eigh(np.cov((corners - middle).T))[1].T
    both = np.concatenate([directions, -directions])
    chosen = set((both @ corners.T).argmax(axis=1).tolist())
    while True:
        light = Manifold.hull_points(corners[sorted(chosen)])
        if light.is_empty() or light.volume() <= 0:
            return hull, 0.0
        normals, offsets = faces_of(light)
        beyond = (corners @ normals.T - offsets).max(axis=1)
        worst = float(beyond.max())
        full = light.volume() >= (1 - _LOST) * hull.volume()
        if (worst <= by and full) or len(chosen) >= min(most, len(corners)):
            return light, max(worst, 0.0)
        height = corners @ normals.T - offsets
        farthest = np.unique(height.argmax(axis=0)[height.max(axis=0) > min(by, worst) / 2])
        ranked = farthest[np.argsort(-beyond[farthest])]
        chosen.update(ranked[: min(_FEW, most - len(chosen))].tolist())
