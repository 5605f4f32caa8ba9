"""A profile's parallel curve within it: what is left of the profile at least so deep inside."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.profile import Corner, Profile, Side

_NEWTON, _CONVERGED = 50, 1e-11
_ROUNDED = 1e-14  # of coordinates
_SMOOTH = 1e-6  # radians: sides that turn by less run on smoothly


class Wall(NamedTuple):
    """What a side, or the corner before it, becomes: `below` on the profile, `above` on its parallel curve.

    Of a corner that turns inwards, below is None: an arc about `start` grows out of it.
    """

    start: tuple[float, float]
    below: Side | None
    above: Side


def offset(profile: Profile, depth: float, curved: bool = False) -> tuple[Profile, list[list[Wall]]]:
    """The points at least `depth` > 0 inside of the profile, and how their boundary grows out of it.

    Walls are listed loop by loop, side by side. Corners that turn outwards stay corners, those that
    turn inwards become arcs. Every side has to be left. curved: also corners that turn outwards at an arc,
    which then move along a curve as the depth grows.

    Raises:
        ParameterError: a side vanishes, parts of the outline meet, or without `curved` a corner turns
            outwards at an arc, whose parallel meets the other side's on no straight line.
    """
    loops, walls = [], []
    for sides in profile.sides:
        corners: list[Corner] = []
        grown: list[tuple[tuple[float, float], Side | None]] = []
        count = len(sides)
        begins = [_begin(sides[i - 1], sides[i], depth, curved) for i in range(count)]
        for i, side in enumerate(sides):
            arrive, leave = begins[i]
            if arrive is not leave:
                bend = turn_between(sides[i - 1], side)
                corners.append((*arrive, math.tan(bend / 4)))
                grown.append((side.start, None))
            bulge = kept_bulge(side, leave, begins[(i + 1) % count][0], depth, curved)
            corners.append((*leave, bulge))
            grown.append((side.start, side))
        loops.append(tuple(corners))
        walls.append(grown)
    try:
        inner = Profile.of_loops(loops)
    except ParameterError as error:
        raise _too_deep(depth) from error
    made = [
        [Wall(start, below, above) for (start, below), above in zip(grown, sides, strict=True)]
        for grown, sides in zip(walls, inner.sides, strict=True)
    ]
    if any(
        a.above.start != (c[0], c[1])
        for w, loop in zip(made, loops, strict=True)
        for a, c in zip(w, loop, strict=True)
    ):
        raise _too_deep(depth)  # a loop has turned inside out
    return inner, made


def _too_deep(depth: float) -> ParameterError:
    return ParameterError(f"profile: not every side of it is left {depth:.6g} further inside")


Point = tuple[float, float]


def turn_between(before: Side, after: Side) -> float:
    """Signed angle by which the way turns: positive to the left, at a corner that points outwards."""
    a, b = before.direction(at_end=True), after.direction()
    return math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)


def turns_at_arcs(profile: Profile) -> bool:
    """Whether there is a corner that turns outwards where one of its sides is an arc."""
    pairs = (pair for sides in profile.sides for pair in zip((sides[-1], *sides), sides, strict=False))
    return any(turn_between(*pair) > _SMOOTH and (pair[0].centre or pair[1].centre) for pair in pairs)


def _begin(before: Side, after: Side, depth: float, curved: bool) -> tuple[Point, Point]:
    """Where the parallel of `before` ends and that of `after` begins: one and the same point, unless an arc
    lies between."""
    corner = np.array(after.start)
    a, b = (np.array([-d[1], d[0]]) for d in (before.direction(at_end=True), after.direction()))
    bend = turn_between(before, after)
    if abs(bend) <= _SMOOTH:
        x, y = (corner + depth * b).tolist()
        return (point := (x, y)), point
    if bend < 0:
        (ax, ay), (bx, by) = (corner + depth * a).tolist(), (corner + depth * b).tolist()
        return (ax, ay), (bx, by)
    if curved and (before.centre is not None or after.centre is not None):
        return (point := parallels_cross(before, after, depth, depth)), point
    if before.centre is not None or after.centre is not None:
        raise ParameterError(
            f"profile: at ({after.start[0]:.6g}, {after.start[1]:.6g}) an arc meets a side at a corner, "
            "which a taper cannot carry on; round the corner, or leave the taper 0"
        )
    x, y = (corner + depth * (a + b) / (1 + a @ b)).tolist()
    return (point := (x, y)), point


def parallels_cross(before: Side, after: Side, deep: float, deeper: float) -> Point:
    """Where the parallels of two sides that meet at a corner meet, each so deep within: by Newton's method.

    Raises:
        ParameterError: they do not.
    """
    depth = max(abs(deep), abs(deeper))
    at = np.array(after.start)
    near = _CONVERGED * depth + _ROUNDED * (float(np.abs(at).max()) + before.radius + after.radius)
    for _ in range(_NEWTON):
        pairs = [_parallel(before, at, deep, True), _parallel(after, at, deeper, False)]
        off = np.array([distance for distance, _ in pairs])
        slopes = np.array([direction for _, direction in pairs])
        if abs(np.linalg.det(slopes)) < _SMOOTH:
            raise _too_deep(depth)
        step = np.linalg.solve(slopes, off)
        at = at - step
        if np.linalg.norm(step) <= near:
            break
    else:
        raise _too_deep(depth)
    x, y = at.tolist()
    return x, y


def _parallel(side: Side, at: np.ndarray, depth: float, at_end: bool) -> tuple[float, np.ndarray]:
    """How far (2,) lies within the parallel of a side, and the direction in which that grows."""
    if side.centre is None:
        x, y = side.direction(at_end=at_end)
        inwards = np.array([-y, x])
        return float((at - side.start) @ inwards) - depth, inwards
    way = np.subtract(side.centre, at) * math.copysign(1.0, side.sweep)
    reach = float(np.linalg.norm(way))
    deep = (side.radius - reach) * math.copysign(1.0, side.sweep)
    return deep - depth, way / max(reach, 1e-300)


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
