"""A profile's parallel curve within it: what is left of the profile at least so deep inside."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.profile import Corner, Profile, Side

_SMOOTH = 1e-6  # radians: sides that turn by less run on smoothly


Point = tuple[float, float]


class Wall(NamedTuple):
    """What a side, or the corner before it, becomes: `below` on the profile, `above` on its parallel curve.

    Of a corner that turns inwards, below is None: an arc about `start` grows out of it.
    """

    start: tuple[float, float]
    below: Side | None
    above: Side


class Mover(NamedTuple):
    """What moves inwards of a loop: a side, or an arc that grows about a corner that turns inwards.

    start: where it begins on the profile. below: the side, None of such an arc. side: that whose parallel it
    runs along, of such an arc one of radius 0.
    """

    start: tuple[float, float]
    below: Side | None
    side: Side


class Front(NamedTuple):
    """A loop on its way inwards. left: which of its movers are, in order. met: those that meet the one before
    only since what lay between has vanished."""

    movers: tuple[Mover, ...]
    left: tuple[int, ...]
    met: frozenset[int]

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Of what is left, each with what comes after it."""
        return zip(self.left, (*self.left[1:], self.left[0]), strict=True)


def front_of(sides: Sequence[Side]) -> Front:
    """A loop with all its sides."""
    movers: list[Mover] = []
    for before, side in zip((sides[-1], *sides), sides, strict=False):
        bend = turn_between(before, side)
        if bend < -_SMOOTH:
            point = Side(side.start, side.start, math.tan(bend / 4), side.start, 0.0, bend)
            movers.append(Mover(side.start, None, point))
        movers.append(Mover(side.start, side, side))
    return Front(tuple(movers), tuple(range(len(movers))), frozenset())


def offset(profile: Profile, depth: float, curved: bool = False) -> tuple[Profile, list[list[Wall]]]:
    """The points at least `depth` > 0 inside of the profile, and how their boundary grows out of it.

    Walls are listed loop by loop, side by side. Corners that turn outwards stay corners, those that
    turn inwards become arcs. Every side has to be left. curved: also corners that turn outwards at an arc,
    which then move along a curve as the depth grows.

    Raises:
        ParameterError: a side vanishes, parts of the outline meet, or without `curved` a corner turns
            outwards at an arc, whose parallel meets the other side's on no straight line.
    """
    return moved_in([front_of(sides) for sides in profile.sides], depth, curved)


def moved_in(fronts: Sequence[Front], depth: float, curved: bool = True) -> tuple[Profile, list[list[Wall]]]:
    """`offset` of what is left of loops; the walls of what is not end in a point, an arc of radius 0 where
    they were arcs."""
    loops: list[tuple[Corner, ...]] = []
    for front in fronts:
        begins = [meeting(front, *pair, depth, curved) for pair in front.pairs()]
        starts = [begins[-1], *begins[:-1]]
        sides = [front.movers[k].side for k in front.left]
        bulges = [kept_bulge(*one, depth, curved) for one in zip(sides, starts, begins, strict=True)]
        loops.append(tuple((*at, bulge) for at, bulge in zip(starts, bulges, strict=True)))
    try:
        inner = Profile.of_loops(loops)
    except ParameterError as error:
        raise _too_deep(depth) from error
    walls = [_walls(*pair) for pair in zip(fronts, inner.sides, strict=True)]
    kept = [[side.start for side in sides] for sides in inner.sides]
    if kept != [[(x, y) for x, y, _ in loop] for loop in loops]:
        raise _too_deep(depth)  # a loop has turned inside out
    return inner, walls


def _walls(front: Front, above: Sequence[Side]) -> list[Wall]:
    """above: what is left, in order."""
    own = dict(zip(front.left, above, strict=True))
    made = []
    for k, mover in enumerate(front.movers):
        if k in own:
            end = own[k]
        else:
            after = next((left for left in front.left if left > k), front.left[0])
            x, y = own[after].start
            arc = mover.side.centre is not None
            end = Side((x, y), (x, y), 0.0, (x, y) if arc else None, 0.0, mover.side.sweep)
        made.append(Wall(mover.start, mover.below, end))
    return made


def _too_deep(depth: float) -> ParameterError:
    return ParameterError(f"profile: not every side of it is left {depth:.6g} further inside")


def turn_between(before: Side, after: Side) -> float:
    """Signed angle by which the way turns: positive to the left, at a corner that points outwards."""
    a, b = before.direction(at_end=True), after.direction()
    return math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)


def turns_at_arcs(profile: Profile) -> bool:
    """Whether there is a corner that turns outwards where one of its sides is an arc."""
    pairs = (pair for sides in profile.sides for pair in zip((sides[-1], *sides), sides, strict=False))
    return any(turn_between(*pair) > _SMOOTH and (pair[0].centre or pair[1].centre) for pair in pairs)


def meeting(front: Front, k: int, after: int, depth: float, curved: bool = True) -> Point:
    """Where the parallels of two movers meet, the second of which comes after the first.

    Raises:
        ParameterError: they do not.
    """
    before, other = front.movers[k], front.movers[after]
    if after in front.met:
        return parallels_cross(before.side, other.side, depth, depth)
    corner, ways = np.array(other.start), []
    if before.below is not None:
        ways.append(before.side.direction(at_end=True))
    if other.below is not None:
        ways.append(other.side.direction())
    a, b = (np.array([-way[1], way[0]]) for way in (ways[0], ways[-1]))
    arcs = before.side.centre is not None or other.side.centre is not None
    if len(ways) < 2 or abs(turn_between(before.side, other.side)) <= _SMOOTH:
        x, y = (corner + depth * b).tolist()
    elif not arcs:
        x, y = (corner + depth * (a + b) / (1 + a @ b)).tolist()
    elif curved:
        x, y = parallels_cross(before.side, other.side, depth, depth)
    else:
        raise ParameterError(
            f"profile: at ({other.start[0]:.6g}, {other.start[1]:.6g}) an arc meets a side at a corner, "
            "which a taper cannot carry on; round the corner, or leave the taper 0"
        )
    return x, y


def parallels_cross(before: Side, after: Side, deep: float, deeper: float, turn: float = 1.0) -> Point:
    """Where the parallels of two sides meet, each so deep within, as if these went on: of two places that
    where the way turns to the left, or to the right where `turn` is negative.

    Raises:
        ParameterError: they do not.
    """
    depth = max(abs(deep), abs(deeper))
    one, other = _Parallel.of(before, deep), _Parallel.of(after, deeper)
    if one.centre is None and other.centre is None:
        across = one.way[0] * other.way[1] - one.way[1] * other.way[0]
        if across * turn <= _SMOOTH:
            raise _too_deep(depth)
        x, y = np.linalg.solve(np.array([one.inwards, other.inwards]), [one.level, other.level]).tolist()
        return x, y
    if one.centre is None or other.centre is None:
        line, circle = (one, other) if one.centre is None else (other, one)
        along, foot = line.way, circle.centre + (line.level - line.inwards @ circle.centre) * line.inwards
        sign = circle.sign if one.centre is None else -circle.sign
    else:
        apart = other.centre - one.centre
        distance = float(np.linalg.norm(apart))
        if distance <= _SMOOTH * depth:
            raise _too_deep(depth)
        ahead = apart / distance
        share = (one.radius**2 - other.radius**2 + distance**2) / (2 * distance)
        along, foot = np.array([-ahead[1], ahead[0]]), one.centre + share * ahead
        circle, sign = one, one.sign * other.sign
    room = circle.radius**2 - float(((foot - circle.centre) ** 2).sum())
    if room < 0 or min(one.radius, other.radius) < 0:
        raise _too_deep(depth)
    x, y = (foot + math.copysign(math.sqrt(room), sign * turn) * along).tolist()
    return x, y


@dataclass(frozen=True)
class _Parallel:
    """A line, of what is at a level inwards, or a circle, in the direction of its sign."""

    way: np.ndarray
    level: float
    centre: np.ndarray | None
    radius: float
    sign: float

    @classmethod
    def of(cls, side: Side, depth: float) -> _Parallel:
        if side.centre is None:
            way = side.direction()
            return cls(way, float(np.array([-way[1], way[0]]) @ side.start) + depth, None, 0.0, 0.0)
        sign = math.copysign(1.0, side.sweep)
        return cls(np.zeros(2), 0.0, np.array(side.centre), side.radius - sign * depth, sign)

    @property
    def inwards(self) -> np.ndarray:
        return np.array([-self.way[1], self.way[0]])


def kept_bulge(side: Side, start: Point, end: Point, depth: float, curved: bool) -> float:
    """The bulge of a side's parallel between two points. Raises ParameterError where nothing is left."""
    way = np.subtract(end, start)
    if side.centre is None:
        if way @ side.direction() <= 1e-9 * abs(depth):
            raise _too_deep(depth)
        return 0.0
    shrinks = depth if side.sweep > 0 else -depth
    if side.radius - shrinks <= 1e-9 * abs(depth):
        raise _too_deep(depth)
    first, last = (np.subtract(p, side.centre) for p in (start, end))
    sweep = math.atan2(first[0] * last[1] - first[1] * last[0], first @ last)
    less = math.remainder(sweep - side.sweep, 2 * math.pi)
    if not curved and abs(less) > 1e-3:
        raise _too_deep(depth)
    kept = side.sweep + less
    if kept * side.sweep <= 0:
        raise _too_deep(depth)
    return math.tan(kept / 4) if curved else side.bulge
