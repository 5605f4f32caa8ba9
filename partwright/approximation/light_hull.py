"""A convex solid with few corners: engines collide each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.hull_faces import faces_of
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_MOST = 256  # corners
_LOST = 3e-3  # of the volume: what is thin or round keeps more corners
_PLAIN = 5e-4  # of the volume, that a plain hull may lose
_EDGES, _HALVINGS = 0.01, 10  # of the size: edges that are tried to be done without; then half, and so on
_FEW, _SHARE = 8, 8  # corners that are taken at once: so many, or one for this many that are


def plain_hull(hull: Manifold) -> Manifold:
    """Without the corners that hardly count: at once, where `light_hull` chooses."""
    if hull.num_vert() <= _FEW:
        return hull
    size = float(np.ptp(np.reshape(hull.bounding_box(), (2, 3)), axis=0).max())
    # Of a hull as thin as rounding, no copy may have the volume.
    for halving in range(_HALVINGS):
        plain = hull_of(surface_of(hull.simplify(_EDGES * size / 2**halving))[0])
        if plain.volume() >= (1 - _PLAIN) * hull.volume():
            return plain
    return hull


def light_hull(hull: Manifold, by: float, most: int = _MOST, lost: float = _LOST) -> tuple[Manifold, float]:
    """The hull of some of its corners, those added first that stick out most; and how far (a length) any of
    the others sticks out of it: no more than `by`, unless that would take more than `most` corners.

    lost: share of its volume that it may lose."""
    corners = surface_of(hull)[0]
    if len(corners) <= _FEW:
        return hull, 0.0
    middle = corners.mean(axis=0)
    directions = np.linalg.eigh(np.cov((corners - middle).T))[1].T
    both = np.concatenate([directions, -directions])
    chosen = set((both @ corners.T).argmax(axis=1).tolist())
    while True:
        light = hull_of(corners[sorted(chosen)])
        if light.is_empty() or light.volume() <= 0:
            return hull, 0.0
        normals, offsets = faces_of(light)
        height = corners @ normals.T - offsets
        beyond = height.max(axis=1)
        worst = float(beyond.max())
        full = light.volume() >= (1 - lost) * hull.volume()
        if (worst <= by and full) or len(chosen) >= min(most, len(corners)):
            return light, max(worst, 0.0)
        farthest = np.unique(height.argmax(axis=0)[height.max(axis=0) > min(by, worst) / 2])
        ranked = farthest[np.argsort(-beyond[farthest])]
        more = max(_FEW, len(chosen) // _SHARE)
        chosen.update(ranked[: min(more, most - len(chosen))].tolist())
