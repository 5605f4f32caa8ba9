"""Whether the loops of a profile are simple: no side crosses another, and holes lie where holes may."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_TOUCHING = 1e-9  # of the segments' lengths: what crosses by less touches


def first_crossing(loops: Sequence[np.ndarray]) -> np.ndarray | None:
    """A place (2,) where two of the closed polylines' (K, 2) segments cross; None where none do."""
    start = np.concatenate(loops)
    end = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    low, high = np.minimum(start, end), np.maximum(start, end)
    way = end - start
    for i in range(len(start) - 1):
        near = (low[i + 1 :] <= high[i]).all(axis=1) & (high[i + 1 :] >= low[i]).all(axis=1)
        other = i + 1 + np.flatnonzero(near)
        if not len(other):
            continue
        along = _cross(way[i], start[other] - start[i]), _cross(way[i], end[other] - start[i])
        back = _cross(way[other], start[i] - start[other]), _cross(way[other], end[i] - start[other])
        least = _TOUCHING * np.linalg.norm(way[i]) * np.linalg.norm(way[other], axis=1)
        apart = [np.minimum(*pair) < -least for pair in (along, back)]
        beyond = [np.maximum(*pair) > least for pair in (along, back)]
        crossing = apart[0] & apart[1] & beyond[0] & beyond[1]
        if crossing.any():
            k = int(other[crossing.argmax()])
            share = back[0][crossing.argmax()] / (back[0] - back[1])[crossing.argmax()]
            return np.asarray(start[i] + share * way[i]) if k >= 0 else None
    return None


def nested(loops: Sequence[np.ndarray]) -> bool:
    """Whether all polylines after the first, none of which cross, lie within it and outside of each other."""
    outline, *holes = loops
    for i, hole in enumerate(holes):
        if not _around(outline, hole):
            return False
        if any(_around(other, hole) for j, other in enumerate(holes) if i != j):
            return False
    return True


def _around(loop: np.ndarray, other: np.ndarray) -> bool:
    """Whether the loop holds most middles of the other's segments: a few may lie on it."""
    points = (other + np.roll(other, -1, axis=0)) / 2
    a, b = loop, np.roll(loop, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] <= y) != (b[:, 1] <= y)
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    left = x < a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
    inside = (crosses & left).sum(axis=1) % 2 == 1
    return bool(inside.mean() > 0.5)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
