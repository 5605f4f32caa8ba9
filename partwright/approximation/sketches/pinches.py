"""Outlines that touch themselves: a hole that reaches the edge of its section is traced as part of it."""

from __future__ import annotations

import math

import numpy as np

from partwright.fields.profile import Loop

_AWAY = 2.0  # times the tolerance


def unpinched(outline: Loop, tolerance: float) -> tuple[Loop, list[Loop]]:
    """The outline, counter-clockwise, without what it runs around clockwise between two visits of one place,
    and that as holes, whose corner there is moved twice the tolerance away from the outline.

    tolerance: length within which corners are one.
    """
    for i in range(len(outline)):
        for j in range(i + 2, len(outline) - (i == 0)):
            if math.dist(outline[i][:2], outline[j][:2]) > tolerance:
                continue
            for inner, outer in (
                (outline[i:j], outline[j:] + outline[:i]),
                (outline[j:] + outline[:i], outline[i:j]),
            ):
                if len(outer) >= 2 and _clockwise(inner):
                    rest, holes = unpinched(outer, tolerance)
                    return rest, [_moved_away(inner, _AWAY * tolerance), *holes]
    return outline, []


def _clockwise(loop: Loop) -> bool:
    """Of its chords, or of the arcs where there are two."""
    x, y, bulge = np.array(loop).T
    if len(loop) == 2:
        return bool(bulge.sum() < 0)
    return bool((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() < 0)


def _moved_away(hole: Loop, distance: float) -> Loop:
    """With the first corner moved towards the middle of the hole."""
    (x, y, bulge), *others = hole
    middle = np.mean([corner[:2] for corner in hole], axis=0)
    way = middle - (x, y)
    x, y = np.array([x, y]) + distance * way / max(float(np.linalg.norm(way)), distance)
    return ((float(x), float(y), bulge), *others)
