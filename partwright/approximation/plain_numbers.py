"""Parts with the plainest numbers within a tolerance: 36.49998 read off a surface was typed as 36.5."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import Any, cast

import numpy as np

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
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Field, Revolution, Solid, Swept
from partwright.fields.profile import Loop, Profile

_ANGLES = ("taper", "angle")
_ALONG = 1e-9  # of a cosine
_MOVED = 3.0  # times as far as a number, that the numbers of a circle move a place together


def plain(value: float, within: float) -> float:
    """The number of the fewest digits at most `within` away: 0, or multiples of 0.5 before further digits."""
    if value == 0 or within <= 0:
        return value
    if abs(value) <= within:
        return 0.0
    digits = -math.floor(math.log10(abs(value)))
    for decimals in range(digits, 13):
        for halves in (1, 2):
            unit = 10.0**-decimals / halves
            nearest = round(value / unit) * unit
            if abs(nearest - value) <= within:
                return round(nearest, max(decimals + halves - 1, 0)) + 0.0
    return value


def with_plain_numbers(part: Part, within: float) -> Part:
    """With lengths, corners and places made plain, each by at most `within` (own units). Turns lose their
    dust alone, and copies that are turned, in no pattern, are at plain places.

    A field that does not allow its plain numbers stays as it is.
    """
    part = dataclasses.replace(part, rotation=typed_turn(part.rotation))
    try:
        field = _plain_field(part.field, within)
    except ParameterError:
        field = part.field
    copies = _plain_copies(part, within)
    if copies is None:
        own = Similarity(1.0, part.rotation, part.translation)
        plain_own = Similarity(1.0, part.rotation, _plain_place(part.translation, within))
        moves = tuple(_plain_copy(move, own, plain_own, within) for move in part.instances)
        copies = dataclasses.replace(part, translation=plain_own.translation, instances=moves)
    return _between_plain_ends(part, dataclasses.replace(copies, field=field), within)


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


def _between_plain_ends(given: Part, part: Part, within: float) -> Part:
    """Between plain ends where its axes are the coordinates', so that parts that meet there go on meeting:
    along z, and a box without copies on all sides.

    given: the part before its numbers were made plain.
    """
    if within <= 0:
        return part
    try:
        for axis in (0, 1, 2) if isinstance(part.field, Box) and not part.instances else (2,):
            part = _between(given, part, axis, within)
    except ParameterError:
        pass
    return part


def _between(given: Part, part: Part, axis: int, within: float) -> Part:
    """With ends that are plain along one of its axes; what has none there, or lies askew, as it is."""
    column = rotation_matrix(part.rotation)[:, axis]
    k = int(np.abs(column).argmax())
    moved = abs(given.translation[k] - part.translation[k])  # another copy may have become the first
    if abs(column[k]) < 1 - _ALONG or moved > _MOVED * within:
        return part
    field: Any = part.field
    if isinstance(field, Revolution):
        return _at_plain_levels(given, part, k, float(column[k]), within)
    length = _length(given.field, axis)
    if length is None or _length(field, axis) is None:
        return part
    # Of ends at one level the same number comes, whatever else the parts are.
    low, high = (plain(given.translation[k] + end * length / 2, within) for end in (-1, 1))
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


def _at_plain_levels(given: Part, part: Part, k: int, sign: float, within: float) -> Part:
    """What is turned, with corners at plain levels along its axis, which is the coordinate `k`."""
    own, place = cast(Revolution, given.field), part.translation[k]

    def loop(before: Loop, now: Loop) -> Loop:
        levels = (plain(given.translation[k] + sign * y, within) for _, y, _ in before)
        return tuple(
            (x, round(sign * (level - place), 12), b) for (x, _, b), level in zip(now, levels, strict=True)
        )

    before, now = own.profile, cast(Revolution, part.field).profile
    holes = tuple(loop(*pair) for pair in zip(before.holes, now.holes, strict=True))
    field = dataclasses.replace(
        cast(Revolution, part.field), profile=Profile(loop(before.outline, now.outline), holes)
    )
    return dataclasses.replace(part, field=field)


def _names(field: Any) -> set[str]:
    return {own.name for own in dataclasses.fields(field)} if dataclasses.is_dataclass(field) else set()


def _plain_field(field: Field, within: float) -> Field:
    if not isinstance(field, Solid | Swept):
        return field
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
