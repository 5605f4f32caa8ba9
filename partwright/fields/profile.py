"""A profile: a closed outline of lines and arcs in a plane, with holes. What is extruded or turned."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, pairwise
from reprlib import repr as brief
from typing import Any, NamedTuple

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, checked
from partwright.fields.profile_crossings import first_crossing, nested
from partwright.rows import lengths

Corner = tuple[float, float, float]
Loop = tuple[Corner, ...]

STRAIGHT = 1e-9
"""A bulge that is smaller is none."""
_MOST_BULGE = 100.0  # an arc of 358 degrees
_MOST_CORNERS = 5_000
_QUARTER = math.tan(math.pi / 8)


class Side(NamedTuple):
    """One line or arc of a loop, from `start` to `end`, (x, y) each; the solid lies on its left.

    centre and radius are an arc's, None and 0 of a line; sweep is its signed angle, positive where it runs
    counter-clockwise.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    bulge: float
    centre: tuple[float, float] | None
    radius: float
    sweep: float

    @property
    def middle(self) -> tuple[float, float]:
        """The point half way along."""
        (ax, ay), (bx, by), b = self.start, self.end, self.bulge
        return (ax + bx) / 2 + b * (by - ay) / 2, (ay + by) / 2 - b * (bx - ax) / 2

    def direction(self, at_end: bool = False) -> np.ndarray:
        """(2,) unit tangent at its start or end."""
        chord = np.subtract(self.end, self.start)
        turn = (self.sweep / 2) * (1 if at_end else -1)
        c, s = math.cos(turn), math.sin(turn)
        x, y = chord / np.linalg.norm(chord)
        return np.array([c * x - s * y, s * x + c * y])


@dataclass(frozen=True)
class Profile:
    """A region of the plane within one closed outline and outside of its holes.

    Args:
        outline: corners (x, y), or (x, y, bulge): the bulge is of the side from this corner to the next, the
            tangent of a quarter of its arc's angle (as in DXF): 0 a line, 1 half a circle to the right of the
            way to the next corner, -1 one to the left. Two corners of bulge 1 are a circle.
        holes: the same, each within the outline and outside of the others.

    Kept counter-clockwise, holes clockwise, so that the solid lies on the left of every side.

    Raises:
        ParameterError: fewer than two corners, neighbours that coincide, sides that cross, no area, or a hole
            that is not within the outline.
    """

    outline: Loop
    holes: tuple[Loop, ...] = field(default=())

    def __post_init__(self) -> None:
        if not isinstance(self.holes, tuple | list):
            raise ParameterError(f"profile: holes are {brief(self.holes)}; expected a list of closed loops")
        outline = _oriented(_loop(self.outline, "outline"), 1.0)
        holes = tuple(_oriented(_loop(h, f"holes[{i}]"), -1.0) for i, h in enumerate(self.holes))
        if sum(map(len, (outline, *holes))) > _MOST_CORNERS:
            raise ParameterError(f"profile: expected at most {_MOST_CORNERS:,} corners")
        object.__setattr__(self, "outline", outline)
        object.__setattr__(self, "holes", holes)
        lines = self.polylines(self.size / 500)
        crossing = first_crossing(lines)
        if crossing is not None:
            raise ParameterError("profile: sides cross near ({:.6g}, {:.6g})".format(*crossing))
        if not nested(lines):
            raise ParameterError("profile: a hole lies outside of the outline, or within another hole")

    @classmethod
    def of_loops(cls, loops: Sequence[Loop]) -> Profile:
        """Of the outline, then the holes, as `loops` has them."""
        return cls(loops[0], tuple(loops[1:]))

    @classmethod
    def polygon(cls, points: Sequence[Sequence[float]]) -> Profile:
        """Through points (K, 2) by straight sides."""
        return cls(tuple((float(x), float(y), 0.0) for x, y in points))

    @classmethod
    def circle(cls, radius: float, centre: Sequence[float] = (0.0, 0.0)) -> Profile:
        return cls(circle(radius, centre))

    @classmethod
    def rectangle(cls, width: float, height: float, corner: float = 0.0) -> Profile:
        """Centred at the origin, `width` along x; corner: the radius by which corners are rounded."""
        x, y, r = width / 2, height / 2, corner
        if r <= 0:
            return cls.polygon([(-x, -y), (x, -y), (x, y), (-x, y)])
        b = _QUARTER
        if r >= min(x, y):
            r = min(x, y)
        corners = [(r - x, -y, 0.0), (x - r, -y, b), (x, r - y, 0.0), (x, y - r, b)]
        corners += [(-px, -py, bulge) for px, py, bulge in corners]
        return cls(tuple(_without_points(corners)))

    @classmethod
    def regular(cls, sides: int, radius: float) -> Profile:
        """A regular polygon about the origin; radius: from there to the corners, the first along x."""
        angle = np.arange(sides) * (2 * math.pi / max(sides, 1))
        return cls.polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]).tolist())

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The outline, then the holes."""
        return (self.outline, *self.holes)

    @cached_property
    def corners(self) -> np.ndarray:
        """(V, 3) x, y and bulge of all corners, loop after loop."""
        return np.array(list(chain.from_iterable(self.loops)), dtype=np.float64)

    @cached_property
    def starts(self) -> np.ndarray:
        """(L + 1,) where each loop begins in `corners`, and their number."""
        return np.cumsum([0, *map(len, self.loops)])

    @cached_property
    def sides(self) -> tuple[tuple[Side, ...], ...]:
        """Of each loop, in order."""
        return tuple(tuple(_sides(loop)) for loop in self.loops)

    @cached_property
    def area(self) -> float:
        return sum(map(loop_area, self.loops))

    @cached_property
    def size(self) -> float:
        """The longest side of the box around it."""
        lower, upper = self.bounds()
        return float((upper - lower).max())

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (2,)."""
        reach = self.support(np.vstack([-np.eye(2), np.eye(2)]))
        return -reach[:2], reach[2:]

    def support(self, directions: np.ndarray) -> np.ndarray:
        """(K,) how far it reaches along directions (K, 2) of any length."""
        directions = np.asarray(directions, dtype=np.float64)
        outline = np.array(self.outline)
        reach = (directions @ outline[:, :2].T).max(axis=1)
        length = lengths(directions)
        for side in self._outer_arcs:
            assert side.centre is not None
            towards = np.subtract(side.middle, side.centre) / side.radius
            within = directions @ towards >= length * math.cos(side.sweep / 2)
            far = directions @ np.array(side.centre) + length * side.radius
            reach = np.where(within, np.maximum(reach, far), reach)
        return np.asarray(reach)

    @cached_property
    def _outer_arcs(self) -> list[Side]:
        return [side for side in _sides(self.outline) if side.sweep > 0]

    def polylines(self, tolerance: float) -> list[np.ndarray]:
        """Of each loop points (K, 2), so close that chords lie within the tolerance of arcs."""
        return [
            np.array([p for side in _sides(loop) for p in side_points(side, tolerance)])
            for loop in self.loops
        ]

    def scaled(self, factor: float) -> Profile:
        return self._mapped(lambda x, y: (x * factor, y * factor))

    def moved(self, offset: Sequence[float]) -> Profile:
        dx, dy = offset
        return self._mapped(lambda x, y: (x + dx, y + dy))

    def _mapped(self, move: Any) -> Profile:
        loops = [tuple((*move(x, y), b) for x, y, b in loop) for loop in self.loops]
        return self.of_loops(loops)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: corners [x, y] or [x, y, bulge]."""
        loops = [[[x, y, b] if b else [x, y] for x, y, b in loop] for loop in self.loops]
        return {"outline": loops[0]} | ({"holes": loops[1:]} if self.holes else {})

    @classmethod
    def from_dict(cls, data: object) -> Profile:
        """Raises ParameterError for anything but what `to_dict` writes."""
        if not isinstance(data, Mapping) or "outline" not in data or not set(data) <= {"outline", "holes"}:
            raise ParameterError(f"profile: {brief(data)}; expected an object with outline and holes")
        return cls(data["outline"], data.get("holes", ()))

    def __str__(self) -> str:
        sides = [side for loop in self.sides for side in loop]
        arcs = sum(side.centre is not None for side in sides)
        holes = f", {len(self.holes)} hole{'s' if len(self.holes) > 1 else ''}" if self.holes else ""
        return f"of {len(sides) - arcs} lines and {arcs} arcs{holes}"


def loop_of(corners: Iterable[Iterable[float]]) -> Loop:
    """Corners (K, 3), of x, y and bulge, as a loop."""
    return tuple((float(x), float(y), float(bulge)) for x, y, bulge in corners)


def circle(radius: float, centre: Sequence[float] = (0.0, 0.0)) -> Loop:
    """A full circle as a loop of two arcs."""
    x, y = centre
    return ((x - radius, y, 1.0), (x + radius, y, 1.0))


def is_same_loop(one: np.ndarray, other: np.ndarray, near: float, bulge: float) -> bool:
    """Whether loops (K, 3) and (L, 3) have the same corners, whichever each begins with: places that differ
    by less than `near` and bulges by less than `bulge`."""
    if len(one) != len(other):
        return False
    firsts = np.flatnonzero(np.abs(other[:, :2] - one[0, :2]).max(axis=1) < near)
    least = np.array([near, near, bulge])
    return any((np.abs(np.roll(other, -first, axis=0) - one) < least).all() for first in firsts.tolist())


def circle_of(loop: Loop) -> tuple[float, tuple[float, float]] | None:
    """Radius and centre of a loop that is a full circle."""
    sides = list(_sides(loop))
    first = sides[0]
    if first.centre is None or any(side.centre is None for side in sides):
        return None
    same = 1e-9 * first.radius
    alike = all(
        abs(side.radius - first.radius) <= same
        and side.centre is not None
        and math.dist(side.centre, first.centre) <= same
        for side in sides
    )
    turn = sum(side.sweep for side in sides)
    return (first.radius, first.centre) if alike and abs(abs(turn) - 2 * math.pi) < 1e-6 else None


def side_points(side: Side, tolerance: float) -> np.ndarray:
    """(K, 2) from its start up to, but without, its end."""
    if side.centre is None:
        return np.array([side.start])
    count = arc_chords(side.radius, side.sweep, tolerance)
    angle = np.arange(1, count) * (side.sweep / count)
    x, y = np.subtract(side.start, side.centre)
    turned = np.column_stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)])
    return np.concatenate([[side.start], turned + np.array(side.centre)])


def arc_chords(radius: float, sweep: float, tolerance: float) -> int:
    """How many chords keep an arc within the tolerance: at least one for 30 degrees, at most one for half a
    degree."""
    step = 2 * math.acos(max(0.0, 1 - tolerance / radius)) if radius > 0 else 1.0
    return max(1, math.ceil(abs(sweep) / min(max(step, math.pi / 360), math.pi / 6) - 1e-9))


def arc_pieces(side: Side) -> list[tuple[float, float, bool]]:
    """An arc cut at its highest and lowest points: of each piece the heights between which it runs, and
    whether it lies on the right of the centre."""
    assert side.centre is not None
    (cx, cy), (ax, ay), (_, by) = side.centre, side.start, side.end
    begin = math.atan2(ay - cy, ax - cx)
    low, high = sorted((begin, begin + side.sweep))
    levels = [math.pi * (k + 0.5) for k in range(-4, 5)]
    cuts = [low, *(level for level in levels if low < level < high), high]
    heights = [cy + side.radius * round(math.sin(cut)) for cut in cuts]
    heights[0], heights[-1] = (ay, by) if side.sweep > 0 else (by, ay)
    return [
        (min(pair), max(pair), math.cos((cuts[i] + cuts[i + 1]) / 2) > 0)
        for i, pair in enumerate(pairwise(heights))
        if pair[0] != pair[1]
    ]


def _loop(given: object, what: str) -> Loop:
    if not isinstance(given, tuple | list | np.ndarray) or len(given) < 2:
        raise ParameterError(f"profile: {what} is {brief(given)}; expected two corners (x, y, bulge) or more")
    corners: list[Corner] = []
    for i, corner in enumerate(given):
        if not isinstance(corner, tuple | list | np.ndarray) or len(corner) not in (2, 3):
            raise ParameterError(
                f"profile: {what}[{i}] is {brief(corner)}; expected x, y and perhaps a bulge"
            )
        x, y = (checked(f"profile: {what}[{i}]", v, -LARGEST, LARGEST) for v in corner[:2])
        bulge = corner[2] if len(corner) > 2 else 0.0
        b = checked(f"profile: bulge of {what}[{i}]", bulge, -_MOST_BULGE, _MOST_BULGE)
        corners.append((x, y, b if abs(b) > STRAIGHT else 0.0))
    for i, (one, other) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        if one[:2] == other[:2]:
            raise ParameterError(f"profile: {what}[{i}] and the corner after it are the same point")
    return tuple(corners)


def _oriented(loop: Loop, sign: float) -> Loop:
    area = loop_area(loop)
    extent = max(max(v) - min(v) for v in zip(*loop, strict=True))
    if abs(area) <= 1e-12 * extent**2:
        raise ParameterError("profile: a loop encloses no area")
    if area * sign > 0:
        return loop
    order = [0, *range(len(loop) - 1, 0, -1)]
    return tuple((*loop[i][:2], -loop[i - 1][2]) for i in order)


def _sides(loop: Loop) -> Iterator[Side]:
    for (ax, ay, b), (bx, by, _) in zip(loop, loop[1:] + loop[:1], strict=True):
        if b == 0.0:
            yield Side((ax, ay), (bx, by), 0.0, None, 0.0, 0.0)
            continue
        k, vx, vy = (1 - b * b) / (2 * b), (bx - ax) / 2, (by - ay) / 2
        centre = ((ax + bx) / 2 - k * vy, (ay + by) / 2 + k * vx)
        radius = math.hypot(vx, vy) * (1 + b * b) / (2 * abs(b))
        yield Side((ax, ay), (bx, by), b, centre, radius, 4 * math.atan(b))


def loop_area(loop: Loop) -> float:
    """With its arcs; positive where it runs counter-clockwise."""
    total = 0.0
    x0, y0, _ = loop[0]
    for side in _sides(loop):
        (ax, ay), (bx, by) = side.start, side.end
        total += ((ax - x0) * (by - y0) - (bx - x0) * (ay - y0)) / 2
        total += side.radius**2 * (side.sweep - math.sin(side.sweep)) / 2
    return total


def _without_points(corners: Sequence[Corner]) -> Iterator[Corner]:
    """Without sides of no length."""
    for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
        if math.dist(one[:2], other[:2]) > 1e-12 * (abs(one[0]) + abs(one[1])):
            yield one
