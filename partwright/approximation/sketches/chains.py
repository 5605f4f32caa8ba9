"""Chains of corners in the plane, by the kernel: the circle through them, and the corners that lines need."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright import _kernel


def circle_through(points: ArrayLike) -> tuple[NDArray[np.float64], float, float]:
    """Centre (2,), radius, and the largest distance of the points (K, 2) from the circle nearest to them; of
    points on a line the radius and that distance are infinite."""
    x, y, radius, off = _kernel.circle_through(np.ascontiguousarray(points, dtype=np.float64))
    return np.array([x, y]), radius, off


def open_line(points: ArrayLike, tolerance: float) -> NDArray[np.int64]:
    """Indices, in order, ends included, of the corners of an open chain (K, 2) that stay: the farthest from
    chords, until all others lie within the tolerance of them."""
    return _kernel.open_line(np.ascontiguousarray(points, dtype=np.float64), tolerance)
