"""Whether the loops of a profile are simple: no side crosses another, and holes lie where holes may."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.rows import following, lengths

_TOUCHING = 1e-9  # of the segments' lengths: what crosses by less touches
_PAIRS = 1 << 18  # of segments that are looked at at once


def first_crossing(loops: Sequence[np.ndarray]) -> np.ndarray | None:
    """A place (2,) where two of the closed polylines' (K, 2) segments cross; None where none do."""
    start = np.concatenate(loops)
    end = np.concatenate([following(loop) for loop in loops])
    low, high = np.minimum(start, end), np.maximum(start, end)
    way = end - start
    length = lengths(way)
    rows = max(1, _PAIRS // len(start))
    for first in range(0, len(start), rows):
        some = slice(first, first + rows)
        near = np.arange(len(start)) > np.arange(len(start))[some, None]
        for k in range(2):
            near &= low[:, k] <= high[some, k, None]
            near &= high[:, k] >= low[some, k, None]
        one, other = np.nonzero(near)
        one += first
        along = _cross(way[one], start[other] - start[one]), _cross(way[one], end[other] - start[one])
        back = _cross(way[other], start[one] - start[other]), _cross(way[other], end[one] - start[other])
        least = _TOUCHING * length[one] * length[other]
        apart = [np.minimum(*pair) < -least for pair in (along, back)]
        beyond = [np.maximum(*pair) > least for pair in (along, back)]
        crossing = np.flatnonzero(apart[0] & apart[1] & beyond[0] & beyond[1])
        if len(crossing):
            k = int(crossing[0])
            share = back[0][k] / (back[0] - back[1])[k]
            return np.asarray(start[one[k]] + share * way[one[k]])
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
    points = (other + following(other)) / 2
    a, b = loop, following(loop)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] <= y) != (b[:, 1] <= y)
    rise = np.where(b[:, 1] == a[:, 1], 1.0, b[:, 1] - a[:, 1])
    left = x < a[:, 0] + (y - a[:, 1]) / rise * (b[:, 0] - a[:, 0])
    inside = (crosses & left).sum(axis=1) % 2 == 1
    return bool(inside.mean() > 0.5)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
