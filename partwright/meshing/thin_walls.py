"""Whether a solid has walls thinner than a length, as a cut leaves beside another or beside a part's side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_DEPTHS = (0.4, 0.6, 0.8, 1.0)  # of the length, at which a wall's other side is looked for
_STEP = 0.05  # of the length: half of what slopes are measured over
_OPPOSITE = -0.8  # cosine between the slopes at a wall's two sides, at most
_LOOKED_AT = 6000  # vertices at most
_SHARE = 0.005  # of them, from which on a wall is one

Distance = Callable[[np.ndarray], np.ndarray]


def has_thin_walls(distance: Distance, vertices: np.ndarray, length: float) -> bool:
    """distance: of points (N, 3) float32, negative inside. vertices: (V, 3) of the surface, all over it.

    From the surface inwards the other side is met within the length, where the slope points the other way:
    beside an edge that is not acute it does not.
    """
    points = vertices[:: -(-len(vertices) // _LOOKED_AT)].astype(np.float64)
    inwards = -_slope(distance, points, _STEP * length)
    met = np.full(len(points), np.nan)
    for depth in _DEPTHS:
        inside = np.asarray(distance((points + depth * length * inwards).astype(np.float32))) < 0
        met[np.isnan(met) & ~inside] = depth * length
    through = np.flatnonzero(np.isfinite(met))
    if len(through) < _SHARE * len(points):
        return False
    beyond = points[through] + met[through, None] * inwards[through]
    facing = (_slope(distance, beyond, _STEP * length) * -inwards[through]).sum(axis=1)
    return bool(np.count_nonzero(facing < _OPPOSITE) >= _SHARE * len(points))


def _slope(distance: Distance, points: np.ndarray, step: float) -> np.ndarray:
    """(N, 3), of unit length."""
    axes = step * np.eye(3)
    sides = np.concatenate([points + axes[:, None], points - axes[:, None]]).reshape(-1, 3)
    high, low = np.asarray(distance(sides.astype(np.float32)), dtype=np.float64).reshape(2, 3, -1)
    slope = (high - low).T
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12))
