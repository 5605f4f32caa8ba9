"""Parts with the plainest numbers within a tolerance: 36.49998 read off a surface was typed as 36.5."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import Any, cast

import numpy as np

from partwright.approximation.plain import plain
from partwright.approximation.plain_levels import Levels, along, centres, slanting_ends, walls
from partwright.assembly import Part, Similarity
from partwright.assembly.checks import Vector
from partwright.assembly.euler_angles import typed_turn
from partwright.assembly.instance_patterns import (
    Circle,
    Grid,
    Line,
    Pattern,
    Ring,
    Row,
    pattern,
    with_pattern,
)
from partwright.assembly.similarity import NO_ROTATION, rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Extrusion, Field, Pipe, Revolution, Solid, Swept
from partwright.fields.profile import Loop, Profile, circle, circle_of

_ANGLES = ("taper", "angle")
_ALONG = 1e-9  # of a cosine
_ROUNDED_OFF = 1e-2  # of a leg of a pipe, that its bends may take more than it has when they are rounded
_MOVED = 3.0  # times as far as a number, that the numbers of a circle move a place together


def with_plain_numbers(part: Part, within: float, levels: Levels | None = None) -> Part:
    """With lengths, corners and places made plain, each by at most `within` (own units). Turns lose their
    dust alone, and copies that are turned, in no pattern, are at plain places.

    levels: of all parts that it may share walls and axes with, which stay one. A field that does not allow
    its plain numbers stays as it is.
    """
    levels = Levels.of((), within) if levels is None else levels
    pair = _plain_pair(part, within, levels)
    if pair is not None:
        return pair
    part = dataclasses.replace(part, rotation=typed_turn(part.rotation))
    try:
        field = _plain_field(part.field, within)
    except ParameterError:
        field = part.field
    copies = _plain_copies(part, within)
    if copies is None:
        own = Similarity(1.0, part.rotation, part.translation)
        x, y, z = (levels.number(k, value) for k, value in enumerate(part.translation))
        plain_own = Similarity(1.0, part.rotation, (x, y, z))
        moves = tuple(_plain_copy(move, own, plain_own, within) for move in part.instances)
        copies = dataclasses.replace(part, translation=plain_own.translation, instances=moves)
    made = dataclasses.replace(copies, field=field)
    return _on_shared_walls(part, _between_plain_ends(part, made, levels), levels)


def _plain_pair(part: Part, within: float, levels: Levels) -> Part | None:
    """Of two copies along the axes, each where other parts have its walls, as the first has them; None of
    others."""
    if len(part.instances) != 1 or not isinstance(part.field, Box | Extrusion):
        return None
    if any(len(along(copy)) < 3 for copy in part.copies):
        return None
    one, other = (with_plain_numbers(copy, within, levels) for copy in part.copies)
    shifted = _plain_copies(part, within)  # a box that is turned by half is not turned
    if shifted is not None and shifted.instances[0].rotation == NO_ROTATION:
        move = Similarity(translation=tuple(np.subtract(other.translation, one.translation)))
    else:
        move = other.pose @ one.pose.inverse()
    x, y, z = (round(v, 12) + 0.0 for v in move.translation)
    move = Similarity(1.0, typed_turn(move.rotation), (x, y, z))
    return dataclasses.replace(one, name=part.name, instances=(move,))


def _plain_copies(part: Part, within: float) -> Part | None:
    """With copies exactly in a ring, on a circle, in rows, or at places, of plain numbers; None where they
    are in none of these."""
    wanted = _plain_pattern(pattern(part, within), within)
    if wanted is None:
        return None
    if isinstance(wanted, Ring):
        place = _plain_place(part.translation, within)
        return with_pattern(dataclasses.replace(part, translation=place), wanted)
    made = with_pattern(part, wanted)
    places, given = (np.array([copy.translation for copy in one.copies]) for one in (made, part))
    off = np.linalg.norm(given[:, None] - places, axis=2).min(axis=1).max()
    return made if off <= _MOVED * within else None


def _plain_pattern(found: Pattern | None, within: float) -> Ring | Circle | Grid | Line | Row | None:
    if isinstance(found, Row):
        return Row(tuple(_plain_place(place, within) for place in found.places))
    if isinstance(found, Ring):
        return dataclasses.replace(found, centre=_plain_place(found.centre, within))
    if isinstance(found, Circle):
        turn, step = math.degrees(2 * within / found.diameter), 360 / found.count
        diameter, start = plain(found.diameter, within), plain(found.start, turn) % step
        return Circle(found.count, diameter, start, _plain_place(found.centre, within))
    if isinstance(found, Line):
        x, y, z = (plain(v, 2 * within / found.count) for v in found.step)
        return Line(found.count, (x, y, z), _plain_place(found.place, within))
    if isinstance(found, Grid):
        # The outermost of a long row are no further off than the others.
        a, b, c = (plain(v, 2 * within / n) for n, v in zip(found.count, found.spacing, strict=True))
        return Grid(found.count, (a, b, c), _plain_place(found.middle, within))
    return None


def _plain_place(place: Vector, within: float) -> Vector:
    x, y, z = (plain(v, within) for v in place)
    return x, y, z


def _between_plain_ends(given: Part, part: Part, levels: Levels) -> Part:
    """Between plain ends where its axes are the coordinates', so that parts that meet there go on meeting:
    along z, and a box without copies on all sides.

    given: the part before its numbers were made plain.
    """
    if levels.within <= 0:
        return part
    try:
        for axis in (0, 1, 2) if isinstance(part.field, Box) and not part.instances else (2,):
            part = _between(given, part, axis, levels)
    except ParameterError:
        pass
    return part


def _between(given: Part, part: Part, axis: int, levels: Levels) -> Part:
    """With ends that are plain along one of its axes; what has none there, or lies askew, as it is."""
    k, sign = next(((k, sign) for own, k, sign in along(part) if own == axis), (0, 0.0))
    moved = abs(given.translation[k] - part.translation[k])  # another copy may have become the first
    if sign == 0 or moved > _MOVED * levels.within:
        return part
    field: Any = part.field
    if isinstance(field, Revolution):
        return _at_plain_levels(given, part, k, sign, levels)
    length = _length(given.field, axis)
    if length is None or _length(field, axis) is None:
        return part
    # Of ends at one level the same number comes, whatever else the parts are.
    low, high = (levels.number(k, given.translation[k] + end * length / 2) for end in (-1, 1))
    length = round(high - low, 12)
    place = list(part.translation)
    place[k] = round((low + high) / 2, 12) + 0.0
    if isinstance(field, Box):
        x, y, z = (length if a == axis else own for a, own in enumerate(field.size))
        field = Box((x, y, z))
    else:
        field = dataclasses.replace(field, height=length)
    return dataclasses.replace(part, field=field, translation=(place[0], place[1], place[2]))


def _length(field: Any, axis: int) -> float | None:
    """From end to end along one of its own axes."""
    if isinstance(field, Box):
        return field.size[axis]
    return float(field.height) if "height" in _names(field) and axis == 2 else None


def _at_plain_levels(given: Part, part: Part, k: int, sign: float, levels: Levels) -> Part:
    """What is turned, with corners at plain levels along its axis, which is the coordinate `k`."""
    own, place = cast(Revolution, given.field), part.translation[k]

    def loop(before: Loop, now: Loop) -> Loop:
        own = (levels.number(k, given.translation[k] + sign * y) for _, y, _ in before)
        return tuple(
            (x, round(sign * (level - place), 12), b) for (x, _, b), level in zip(now, own, strict=True)
        )

    before, now = own.profile, cast(Revolution, part.field).profile
    holes = tuple(loop(*pair) for pair in zip(before.holes, now.holes, strict=True))
    field = dataclasses.replace(
        cast(Revolution, part.field), profile=Profile(loop(before.outline, now.outline), holes)
    )
    return dataclasses.replace(part, field=field)


def _on_shared_walls(given: Part, part: Part, levels: Levels) -> Part:
    """An extrusion with walls, ends of those that slant, and axes of holes where other parts have them; of
    copies the first.

    given: the part before its numbers were made plain.
    """
    moved = math.dist(given.translation, part.translation)  # another copy may have become the first
    if not isinstance(part.field, Extrusion) or moved > _MOVED * levels.within:
        return part
    try:
        for axis, k, sign in along(part):
            if axis < 2:
                part = _on_shared_walls_across(given, part, axis, k, sign, levels)
    except ParameterError:  # of a profile that crosses itself then
        pass
    return part


def _on_shared_walls_across(given: Part, part: Part, axis: int, k: int, sign: float, levels: Levels) -> Part:
    """The same across one of its axes, the world's `k` but for its sign: the whole is moved so that it lies
    between such walls, or the widest of them stays where its plain profile has it."""
    before, field = cast(Extrusion, given.field).profile, cast(Extrusion, part.field)
    found: dict[float, float] = {}
    for value in {*walls(before, axis), *slanting_ends(before, axis), *centres(before, axis)}:
        level = levels.shared(k, given.translation[k] + sign * value)
        if level is not None:
            found[value] = level
    if not found:
        return part
    numbers = {
        own[axis]: now[axis]
        for loop, made in zip(before.loops, field.profile.loops, strict=True)
        for own, now in zip(loop, made, strict=True)
    }
    place = list(part.translation)
    low, high = min(found), max(found)
    ends = [float(end[axis]) for end in before.bounds()]
    if low < high and np.allclose([low, high], ends, rtol=0, atol=_ALONG * before.size):
        place[k] = round((found[low] + found[high]) / 2, 12) + 0.0
    else:
        widest = max(found, key=lambda value: (value in numbers, abs(value), value))
        place[k] = round(found[widest] - sign * numbers.get(widest, widest), 12) + 0.0

    def there(value: float) -> float:
        return round(sign * (found[value] - place[k]), 12) + 0.0

    def loop_there(loop: Loop, made: Loop) -> Loop:
        round_, now = circle_of(loop), circle_of(made)
        if round_ is not None and now is not None:
            middle = list(now[1])
            if round_[1][axis] in found:
                middle[axis] = there(round_[1][axis])
            return circle(now[0], middle)
        corners = []
        for own, corner in zip(loop, made, strict=True):
            x, y, bulge = corner
            if own[axis] in found:
                x, y = (there(own[axis]), y) if axis == 0 else (x, there(own[axis]))
            corners.append((x, y, bulge))
        return tuple(corners)

    loops = [loop_there(*pair) for pair in zip(before.loops, field.profile.loops, strict=True)]
    moved = dataclasses.replace(field, profile=Profile.of_loops(loops))
    return dataclasses.replace(part, field=moved, translation=(place[0], place[1], place[2]))


def _names(field: Any) -> set[str]:
    return {own.name for own in dataclasses.fields(field)} if dataclasses.is_dataclass(field) else set()


def _plain_field(field: Field, within: float) -> Field:
    if not isinstance(field, Solid | Swept | Pipe):
        return field
    if isinstance(field, Pipe):
        radius, wall = plain(field.radius, within), plain(field.thickness, within)
        made = dataclasses.replace(field, radius=radius, thickness=wall)
        numbers = [[plain(value, within) for value in corner] for corner in field.path]
        return made.with_corners(np.array(numbers), _ROUNDED_OFF)
    given: Any = field  # every kind of them is a dataclass
    names = [own.name for own in dataclasses.fields(given)]
    result: Field = dataclasses.replace(given, **{n: _number(n, getattr(given, n), within) for n in names})
    return result


def _number(name: str, value: Any, within: float) -> Any:
    if isinstance(value, Profile):
        return _plain_profile(value, within)
    if isinstance(value, tuple):
        return tuple(_number(name, v, within) for v in value)
    if not isinstance(value, float | int) or name in _ANGLES:
        return value
    return plain(float(value), within)


def _plain_profile(profile: Profile, within: float) -> Profile:
    def loop(corners: Loop) -> Loop:
        return tuple((plain(x, within), plain(y, within), b) for x, y, b in corners)

    return Profile(loop(profile.outline), tuple(loop(hole) for hole in profile.holes))


def plain_move(move: Similarity, number: Callable[[float], float]) -> Similarity:
    """A shift, also after quarter turns, by plain lengths, as `number` makes them; the foot of another turn
    stays where the turn needs it."""
    rotation = typed_turn(move.rotation)
    if not set(np.abs(rotation_matrix(rotation)).round(12).ravel()) <= {0.0, 1.0}:
        return move
    x, y, z = map(number, move.translation)
    return Similarity(move.scale, rotation, (x, y, z))


def _plain_copy(move: Similarity, own: Similarity, plain_own: Similarity, within: float) -> Similarity:
    """What takes a part's place to a plain one, where the move itself has no plain numbers.

    own: the part's place and turn before, plain_own: after.
    """
    moved = plain_move(move, partial(plain, within=within))
    if moved is not move or np.allclose(
        move.translation, _plain_place(move.translation, within), rtol=_ALONG, atol=0
    ):
        return moved
    pose = move @ own
    copy = Similarity(1.0, typed_turn(pose.rotation), _plain_place(pose.translation, within))
    return copy @ plain_own.inverse()
