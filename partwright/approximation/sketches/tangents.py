"""Corners of a profile where a line and an arc run into one another: at the point of tangency.

The chord beside it leans so little that it may count as part of the line, so that the arc seems to begin one
chord further on, in one slot of a row and not in the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.profile import Loop, Profile, Side
from partwright.fields.profile_offset import kept_bulge, turn_between

_LEAN = math.radians(15)  # by which a line and an arc turn at their corner, at most
_ROUND = math.radians(60)  # an arc's sweep at least: flatter ones stand for other curves, as a tooth's flank
_SMOOTH = 1e-7  # radians: there is nothing to do


def with_tangents(profile: Profile, tolerance: float) -> Profile:
    """The profile with corners moved to points of tangency that are within the tolerance of line and arc, and
    arcs about their centres; as it is where that is none, or sides would cross."""
    try:
        loops = [_tangent(sides, tolerance) for sides in profile.sides]
        if all(loop is None for loop in loops):
            return profile
        return Profile.of_loops([new or old for new, old in zip(loops, profile.loops, strict=True)])
    except ParameterError:
        return profile


def _tangent(sides: Sequence[Side], tolerance: float) -> Loop | None:
    count = len(sides)
    places = [_tangency(sides[i - 1], sides[i], tolerance) for i in range(count)]
    if all(place is None for place in places):
        return None
    starts = [side.start if place is None else place for side, place in zip(sides, places, strict=True)]
    corners = []
    for i, side in enumerate(sides):
        start, end = starts[i], starts[(i + 1) % count]
        moved = (start, end) != (side.start, side.end)
        corners.append((*start, kept_bulge(side, start, end, 0.0, curved=True) if moved else side.bulge))
    return tuple(corners)


def _tangency(before: Side, after: Side, tolerance: float) -> tuple[float, float] | None:
    """Where the corner of two sides belongs, if one is a line and the other an arc about along it."""
    line, arc = (before, after) if before.centre is None else (after, before)
    if line.centre is not None or arc.centre is None or abs(arc.sweep) < _ROUND:
        return None
    turn = abs(turn_between(before, after))
    if not _SMOOTH < turn < _LEAN:
        return None
    way = np.subtract(line.end, line.start)
    way = way / np.linalg.norm(way)
    foot = np.add(line.start, way * float(np.subtract(arc.centre, line.start) @ way))
    off = abs(math.dist(foot, arc.centre) - arc.radius)
    # The corner slides along both, which part by half the turn times the way.
    if off > tolerance or math.dist(foot, after.start) * turn / 2 > tolerance:
        return None
    x, y = foot.tolist()
    return x, y
