"""Rims of an extrusion, the edges between its walls and an end: sharp, rounded (a fillet) or cut off at 45
degrees (a chamfer).

Seen along the rim there is a corner: u is the distance beyond the wall, v that beyond the end, and the solid
lies where both are negative. So the rim changes how the two become one distance, and nothing else. At corners
of the profile that turn outwards rims meet in a mitre; about those that turn inwards they run in an arc.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from partwright.fields.operations import library

_TINY = 1e-30
_CHORDS = 8  # of the polygon around a fillet's quarter circle


class Rim(NamedTuple):
    """Radius of the fillet and length of the chamfer, along wall and end alike; at most one is not 0."""

    fillet: float
    chamfer: float

    @property
    def depth(self) -> float:
        """How far it goes, along the wall and along the end."""
        return max(self.fillet, self.chamfer)

    def distance(self, u: Any, v: Any) -> Any:
        """(N,) exact in the plane of u and v, both (N,), arrays or tensors."""
        xp = library(u)
        if self.fillet:
            a, b = u + self.fillet, v + self.fillet
            over = xp.sqrt(xp.clip(a, 0.0, None) ** 2 + xp.clip(b, 0.0, None) ** 2 + _TINY)
            return over + xp.clip(xp.maximum(a, b), None, 0.0) - self.fillet
        c = self.chamfer
        cut, along = (u + v + c) / math.sqrt(2), u - v
        inside = xp.maximum(xp.maximum(u, v), cut)
        low = xp.sqrt(u * u + (v + c) ** 2 + _TINY)
        high = xp.sqrt((u + c) ** 2 + v * v + _TINY)
        outside = xp.where(along > c, low, xp.where(along < -c, high, cut))
        outside = xp.where(v <= -c, u, xp.where(u <= -c, v, outside))
        return xp.where(inside <= 0, inside, outside)

    def slopes(self, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the distance, each (N,): by u, by v, and by the rim's own number."""
        if self.fillet:
            a, b = u + self.fillet, v + self.fillet
            over = np.maximum(np.hypot(np.maximum(a, 0), np.maximum(b, 0)), _TINY)
            within = np.maximum(a, b) <= 0
            by_u = np.where(within, a > b, np.maximum(a, 0) / over)
            by_v = np.where(within, a <= b, np.maximum(b, 0) / over)
            return by_u, by_v, by_u + by_v - 1
        c, half = self.chamfer, math.sqrt(0.5)
        cut, along = (u + v + c) * half, u - v
        inside = np.maximum(np.maximum(u, v), cut) <= 0
        wall = np.where(inside, (u >= v) & (u >= cut), (v <= -c) & (u > 0))
        end = np.where(inside, (v > u) & (v >= cut), (u <= -c) & (v > 0))
        low = ~inside & ~wall & ~end & (along > c)
        high = ~inside & ~wall & ~end & (along < -c)
        below, above = (np.maximum(np.hypot(*pair), _TINY) for pair in ((u, v + c), (u + c, v)))
        by_u = np.select([wall, end, low, high], [1.0, 0.0, u / below, (u + c) / above], half)
        by_v = np.select([wall, end, low, high], [0.0, 1.0, (v + c) / below, v / above], half)
        by_own = np.select([wall | end, low, high], [0.0, (v + c) / below, (u + c) / above], half)
        return by_u, by_v, by_own

    def steps(self, count: int) -> list[tuple[float, float]]:
        """Points on it from the wall to the end: how deep within the profile, and how far from the end.

        count: chords between them; any number of a chamfer, which is straight.
        """
        if not self.depth:
            return [(0.0, 0.0)]
        if self.chamfer:
            shares = [k / count for k in range(count + 1)]
            return [(self.chamfer * share, self.chamfer * (1 - share)) for share in shares]
        turns = [math.pi / 2 * k / count for k in range(count + 1)]
        return [(self.fillet * (1 - math.cos(t)), self.fillet * (1 - math.sin(t))) for t in turns]

    def step_at(self, depth: float) -> tuple[float, float]:
        """Its point so deep within the profile, as in `steps`."""
        if self.chamfer:
            return depth, self.chamfer - depth
        return depth, self.fillet - math.sqrt(depth * (2 * self.fillet - depth))

    def around(self) -> list[tuple[float, float]]:
        """As `steps`, of the corners of a polygon around it, by tangents of a fillet."""
        if not self.fillet:
            return self.steps(1)
        step = math.pi / 2 / _CHORDS
        inner = [(0.5 + k) * step for k in range(_CHORDS)]
        reach = self.fillet / math.cos(step / 2)
        corners = [(self.fillet - reach * math.cos(t), self.fillet - reach * math.sin(t)) for t in inner]
        return [(0.0, self.fillet), *corners, (self.fillet, 0.0)]
