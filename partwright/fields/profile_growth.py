"""A profile with all of its sides further out: corners stay corners, arcs stay about their centres."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.profile import Corner, Loop, Profile, Side, loop_area
from partwright.fields.profile_offset import Point, kept_bulge, parallels_cross, turn_between

_NEARLY_STRAIGHT = 0.4  # radians: where the corner of a line that moves and one that does not may stay
_NEARLY_SMOOTH = 0.02  # radians: where sides run into one another, their corner moves along their normal


def grown_profile(profile: Profile, by: float, still: Collection[int] = ()) -> Profile:
    """The profile with its sides moved outwards by a length, or inwards where it is negative; holes narrow.

    still: sides, counted over all loops, that stay where they are. Unlike the points within a distance, it
    has as many corners as before, and a sharp one goes further.

    Raises:
        ParameterError: a side vanishes, or sides cross.
    """
    count = sum(len(sides) for sides in profile.sides)
    return with_moved_sides(profile, [0.0 if i in still else by for i in range(count)])


def with_moved_sides(profile: Profile, by: Sequence[float], tilted: bool = False) -> Profile:
    """`grown_profile` with a length for each side, counted over all loops.

    tilted: a line that moves keeps its corner with one that does not and goes on in nearly its direction,
    where their parallels would meet far away."""
    outwards = iter(by)
    loops = [_grown_loop(sides, [-next(outwards) for _ in sides], tilted) for sides in profile.sides]
    result = Profile.of_loops(loops)
    if any(loop_area(a) * loop_area(b) <= 0 for a, b in zip(loops, profile.loops, strict=True)):
        raise ParameterError(f"profile: nothing is left of a loop {-min(by):.6g} further inside")
    return result


def _grown_loop(sides: tuple[Side, ...], depths: list[float], tilted: bool) -> Loop:
    count = len(sides)

    def stays(i: int) -> bool:
        pair = sides[i - 1], sides[i]
        if depths[i - 1] and depths[i]:
            return False
        if not (depths[i - 1] or depths[i]):
            return True
        straight = pair[0].centre is None and pair[1].centre is None
        return tilted and straight and abs(turn_between(*pair)) < _NEARLY_STRAIGHT

    starts = [
        sides[i].start if stays(i) else _corner(sides[i - 1], sides[i], depths[i - 1], depths[i])
        for i in range(count)
    ]
    corners: list[Corner] = []
    for i, side in enumerate(sides):
        bulge = kept_bulge(side, starts[i], starts[(i + 1) % count], depths[i], curved=True)
        corners.append((*starts[i], bulge))
    return tuple(corners)


def _corner(before: Side, after: Side, deep: float, deeper: float) -> Point:
    turn = turn_between(before, after)
    if abs(turn) > _NEARLY_SMOOTH:
        return parallels_cross(before, after, deep, deeper, turn)
    x, y = before.direction(at_end=True) + after.direction()
    inwards = np.array([-y, x]) / math.hypot(x, y)
    px, py = (np.array(after.start) + (deep + deeper) / 2 * inwards).tolist()
    return px, py
