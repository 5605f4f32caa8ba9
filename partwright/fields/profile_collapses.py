"""Sides of a profile that vanish on the way inwards: arcs whose radius is less than the way, short lines
between others. What is beside them meets then.

So the parallel curve of a profile is trimmed, as by the roof over it (Aichholzer et al., A novel type of
skeleton for polygons, 1995), but for profiles that fall apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.profile import Profile
from partwright.fields.profile_distance import profile_distance
from partwright.fields.profile_offset import Front, Wall, front_of, kept_bulge, meeting, moved_in

_HALVINGS = 32
_AT_ONCE = 1e-6  # of a depth, within which the shortest of sides that vanish goes first
_OFF = 1e-6  # of the depth, that a parallel curve may be off

Own = tuple[int, int, int]
"""A mover between the one before and the one after it."""
Going = tuple[float, float, int, Own]
"""At which depth a mover vanishes, how long it is right before, its loop, and which of that it is."""


class Stage(NamedTuple):
    """What is left of each loop from a depth on."""

    depth: float
    fronts: tuple[Front, ...]


def stages(profile: Profile, deepest: float) -> list[Stage]:
    """From the profile itself, at depth 0, to the deepest: one more where a side vanishes.

    Raises:
        ParameterError: nothing is left of a loop.
    """
    found = [_outermost(profile)]
    while going := _going(found[-1], deepest):
        first = (1 + _AT_ONCE) * min(one[0] for one in going)
        now = [one for one in going if one[0] <= first]
        shortest = min(one[1] for one in now)
        depth, _, loop, own = _best([one for one in now if one[1] == shortest], found[-1])
        fronts = found[-1].fronts
        if len(fronts[loop].left) < 3:
            raise ParameterError(f"profile: nothing is left of a loop {deepest:.6g} further inside")
        found.append(_stage_without(found[-1], depth, loop, own))
    return found


def first_collapse(profile: Profile, deepest: float) -> float:
    """The depth at which the first side vanishes; infinite where none does on the way to the deepest."""
    return min((one[0] for one in _going(_outermost(profile), deepest)), default=math.inf)


def section(profile: Profile, found: Sequence[Stage], depth: float) -> tuple[Profile, list[list[Wall]]]:
    """What is left of the profile so deep within it, and how its sides grow out of the profile's. found: its
    stages.

    Raises:
        ParameterError: the profile has fallen apart there.
    """
    own = [stage for stage in found if stage.depth <= depth][-1]
    apart = ParameterError(f"profile: it falls apart {depth:.6g} further inside")
    try:
        inner, walls = moved_in(own.fronts, depth)
    except ParameterError as error:
        raise apart from error
    if len(found) > 1:
        middles = np.array([side.middle for sides in inner.sides for side in sides])
        if np.abs(profile_distance(profile, middles) + depth).max() > _OFF * depth:
            raise apart
    return inner, walls


def _outermost(profile: Profile) -> Stage:
    return Stage(0.0, tuple(front_of(sides) for sides in profile.sides))


def _going(stage: Stage, deepest: float) -> list[Going]:
    """What vanishes of a stage before the deepest."""
    return [
        (*_vanishing(front, own, stage.depth, deepest), k, own)
        for k, front in enumerate(stage.fronts)
        for own in _triples(front)
        if _length(front, own, deepest) is None
    ]


def _triples(front: Front) -> Iterator[Own]:
    left = front.left
    return zip((left[-1], *left[:-1]), left, (*left[1:], left[0]), strict=True)


def _length(front: Front, own: Own, depth: float) -> float | None:
    """How long a mover's parallel is; None where there is none any more."""
    before, k, after = own
    try:
        start, end = meeting(front, before, k, depth), meeting(front, k, after, depth)
        kept_bulge(front.movers[k].side, start, end, depth, curved=True)
    except ParameterError:
        return None
    return float(np.linalg.norm(np.subtract(end, start)))


def _vanishing(front: Front, own: Own, since: float, deepest: float) -> tuple[float, float]:
    """The depth, from one to another, at which a mover does, and how long it is right before."""
    low, high = since, deepest
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if _length(front, own, middle) is None else (middle, high)
    return low, _length(front, own, low) or 0.0


def _best(going: Sequence[Going], stage: Stage) -> Going:
    """Of movers that vanish at once the one without which most others are left right after: of two parallel
    ones that meet neither has a length any more, but only one of them goes."""
    if len(going) == 1:
        return going[0]

    def gone(one: Going) -> int:
        depth, _, loop, own = one
        return len(_going(_stage_without(stage, depth, loop, own), (1 + _AT_ONCE) * depth))

    return min(going, key=gone)


def _stage_without(stage: Stage, depth: float, loop: int, own: Own) -> Stage:
    fronts = stage.fronts
    return Stage(depth, (*fronts[:loop], _without(fronts[loop], own), *fronts[loop + 1 :]))


def _without(front: Front, own: Own) -> Front:
    _, gone, after = own
    return Front(front.movers, tuple(k for k in front.left if k != gone), front.met | {after})
