"""Corners about which an outline crosses itself: a line that comes to an arc from behind meets it once more,
by less than chords tell. There the outline turns where the two sides cross."""

from __future__ import annotations

import math

from partwright.errors import ParameterError
from partwright.fields.profile import Loop, Profile, Side
from partwright.fields.profile_offset import kept_bulge, parallels_cross

_WIDEST = 2e-3  # of the profile's size: between two sides that cross again
_SAME = 1e-6  # of the profile's size: a crossing that is as near is the corner itself


def uncrossed(profile: Profile) -> tuple[tuple[Loop, ...], float]:
    """The profile's loops without such corners, and how far they are off as a length: 0 where there are
    none."""
    loops, off = [], 0.0
    for loop, sides in zip(profile.loops, profile.sides, strict=True):
        found = [_crossing(*pair, profile.size) for pair in zip((sides[-1], *sides), sides, strict=False)]
        off = max(off, *(width for _, width in found))
        starts = [place for place, _ in found]
        ends = [*starts[1:], starts[0]]
        try:
            bulges = [kept_bulge(*one, 0.0, True) for one in zip(sides, starts, ends, strict=True)]
        except ParameterError:  # of a side nothing is left
            return profile.loops, 0.0
        moved = tuple((*place, bulge) for place, bulge in zip(starts, bulges, strict=True))
        loops.append(moved if starts != [side.start for side in sides] else loop)
    return tuple(loops), off


def _crossing(before: Side, after: Side, size: float) -> tuple[tuple[float, float], float]:
    """Where two sides cross once more near the corner between them, and how far they are apart on the way
    there; the corner itself and 0 where they do not."""
    corner = after.start
    if before.centre is None and after.centre is None:
        return corner, 0.0
    for turn in (1.0, -1.0):
        try:
            place = parallels_cross(before, after, 0.0, 0.0, turn)
        except ParameterError:
            continue
        half = math.dist(place, corner) / 2
        if half <= _SAME * size or not (_holds(before, place) and _holds(after, place)):
            continue
        width = _rise(before, half) + _rise(after, half)
        if width <= _WIDEST * size:
            return place, width
    return corner, 0.0


def _holds(side: Side, place: tuple[float, float]) -> bool:
    """Whether a place on the line or circle of a side lies between its ends."""
    if side.centre is None:
        (ax, ay), (bx, by), (x, y) = side.start, side.end, place
        share = (x - ax) * (bx - ax) + (y - ay) * (by - ay)
        return 0 < share < (bx - ax) ** 2 + (by - ay) ** 2
    cx, cy = side.centre
    first, here = (math.atan2(y - cy, x - cx) for x, y in (side.start, place))
    turn = math.copysign(1.0, side.sweep) * (here - first) % (2 * math.pi)
    return 0 < turn < abs(side.sweep)


def _rise(side: Side, half: float) -> float:
    """Of a side above a chord of this half length."""
    return 0.0 if side.centre is None else side.radius - math.sqrt(max(side.radius**2 - half**2, 0.0))
