"""The SuperFrustum's profile as lines and arcs: docs/superfrustum.md's quad, offset by the dilation.

In the plane of (rho, z): z runs along the axis, and rho across the wall from the axis of the rounded corners
of the cross-section. So a corner's radius is rho itself, and sides lie rho beyond the corners' axes. Where
rho is negative the corners are sharp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from partwright.fields import SuperFrustum

Point = tuple[float, float]
_BEYOND = 0.02  # of the longest side


@dataclass(frozen=True)
class Line:
    start: Point
    end: Point

    def until(self, share: float) -> Point:
        (a, b), (c, d) = self.start, self.end
        return a + share * (c - a), b + share * (d - b)

    def cut(self, rho: float = math.nan, z: float = math.nan) -> list[Line]:
        """Its two pieces on both sides of this rho or z, where it crosses it."""
        ends = (self.start[0] - rho, self.end[0] - rho) if z != z else (self.start[1] - z, self.end[1] - z)
        if ends[0] * ends[1] >= 0:
            return [self]
        middle = self.until(ends[0] / (ends[0] - ends[1]))
        middle = (rho, middle[1]) if z != z else (middle[0], z)
        return [Line(self.start, middle), Line(middle, self.end)]


@dataclass(frozen=True)
class Arc:
    """Around `centre`, from angle `first` to `last`, either way."""

    centre: Point
    radius: float
    first: float
    last: float

    def at(self, angle: float) -> Point:
        return self.centre[0] + self.radius * math.cos(angle), self.centre[1] + self.radius * math.sin(angle)

    @property
    def start(self) -> Point:
        return self.at(self.first)

    @property
    def end(self) -> Point:
        return self.at(self.last)

    def cut(self, rho: float = math.nan, z: float = math.nan) -> list[Arc]:
        """Its pieces on both sides of this rho or z, where it crosses it."""
        level = (rho - self.centre[0] if z != z else z - self.centre[1]) / self.radius
        if abs(level) >= 1:
            return [self]
        turn = math.acos(level) if z != z else math.asin(level)
        mirrored = -turn if z != z else math.pi - turn
        low, high = sorted((self.first, self.last))
        angles = [a + 2 * math.pi * k for a in (turn, mirrored) for k in (-1, 0, 1)]
        inner = sorted((a for a in angles if low + 1e-9 < a < high - 1e-9), reverse=self.first > self.last)
        stops = [self.first, *inner, self.last]
        return [Arc(self.centre, self.radius, a, b) for a, b in pairwise(stops)]


Edge = Line | Arc
Outline = list[Edge]  # each edge begins where the one before ends


def outer_outline(f: SuperFrustum, corner: float, d: float) -> Outline:
    """The outer wall from its bottom to its top; `corner` is the radius of the section's corners."""
    m, h = min(f.size[:2]) / 2, f.size[2] / 2
    bottom, top = (corner, -h), (corner + m * (f.taper - 1), h)
    normal = math.atan2(bottom[0] - top[0], top[1] - bottom[1]) if bottom != top else 0.0
    return _wall(bottom, top, d, (-math.pi / 2, normal, math.pi / 2))


def inner_outline(f: SuperFrustum, corner: float, d: float) -> Outline:
    """The wall of the hole from below the part's bottom to above its top: ends that touch cut badly."""
    m, h = min(f.size[:2]) / 2, f.size[2] / 2
    bottom, top = (corner + m * (f.onion - 1), -h), (corner + m * (f.taper * f.onion - 1), h)
    normal = math.atan2(top[0] - bottom[0], bottom[1] - top[1]) if bottom != top else math.pi
    wall = _wall(bottom, top, d, (3 * math.pi / 2, normal % (2 * math.pi), math.pi / 2))
    beyond = _BEYOND * max(f.size)
    (a, low), (b, high) = wall[0].start, wall[-1].end
    return [Line((a, low - beyond), (a, low)), *wall, Line((b, high), (b, high + beyond))]


def clipped(outline: Outline, lowest: float, shortest: float) -> list[Outline]:
    """The runs of the outline in which rho exceeds `lowest`; edges no longer than `shortest` are left out."""
    runs: list[Outline] = [[]]
    for edge in pieces(outline, rho=lowest):
        if max(edge.start[0], edge.end[0]) <= lowest + shortest:
            runs.append([])
        elif math.dist(edge.start, edge.end) > shortest:
            runs[-1].append(edge)
    return [run for run in runs if run]


def pieces(outline: Sequence[Edge], rho: float = math.nan, z: float = math.nan) -> Iterator[Edge]:
    for edge in outline:
        yield from edge.cut(rho, z)


def _wall(bottom: Point, top: Point, d: float, turns: tuple[float, float, float]) -> Outline:
    if d == 0:
        return [Line(bottom, top)]
    low, high = Arc(bottom, d, turns[0], turns[1]), Arc(top, d, turns[1], turns[2])
    return [low, Line(low.end, high.start), high]
