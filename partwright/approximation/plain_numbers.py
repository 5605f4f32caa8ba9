"""Parts with the plainest numbers within a tolerance: 36.49998 read off a surface was typed as 36.5."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Field, Revolution, Solid, Swept
from partwright.fields.profile import Loop, Profile

_ANGLES = ("taper", "angle")
_ROUND = ("cylinder", "cone", "frustum", "sphere", "capsule", "tube", "torus", "hollow_frustum")
_ALONG = 1e-9  # of a cosine
_RING = 1e-6  # radians


def plain(value: float, within: float) -> float:
    """The number of the fewest digits at most `within` away: multiples of 0.5 before further digits."""
    if value == 0 or within <= 0:
        return value
    digits = -math.floor(math.log10(max(abs(value), within)))
    for decimals in range(digits, 13):
        for halves in (1, 2):
            unit = 10.0**-decimals / halves
            nearest = round(value / unit) * unit
            if abs(nearest - value) <= within:
                return round(nearest, max(decimals + halves - 1, 0)) + 0.0
    return value


def with_plain_numbers(part: Part, within: float) -> Part:
    """With lengths, corners and places made plain, each by at most `within` (own units); turns stay.

    A field that does not allow its plain numbers stays as it is.
    """
    x, y, z = (plain(v, within) for v in part.translation)
    try:
        field = _plain_field(part.field, within)
    except ParameterError:
        field = part.field
    moves = tuple(plain_move(move, within) for move in _shifts_where_round(part))
    plain_part = dataclasses.replace(part, field=field, translation=(x, y, z), instances=moves)
    return _between_plain_ends(part, plain_part, within)


def _shifts_where_round(part: Part) -> tuple[Similarity, ...]:
    """The moves to its copies, of what is round about its own axis as shifts where that keeps its direction:
    then a turn only says where it goes. A ring of turns stays one."""
    if not _is_round(part.field) or _is_ring(part.instances):
        return part.instances
    axis = rotation_matrix(part.rotation)[:, 2]
    return tuple(_as_shift(move, part, axis) for move in part.instances)


def _as_shift(move: Similarity, part: Part, axis: np.ndarray) -> Similarity:
    if move.turned(axis) @ axis < 1 - _ALONG:
        return move
    x, y, z = (move(np.array(part.translation)) - part.translation).tolist()
    return Similarity(translation=(x, y, z))


def _is_round(field: Field) -> bool:
    return field.kind in _ROUND or (isinstance(field, Revolution) and field.full)


def _is_ring(moves: tuple[Similarity, ...]) -> bool:
    """Whether they are turns by all multiples of a whole turn's part, and a third of one at most."""
    count = len(moves) + 1
    turns = sorted(2 * math.acos(min(1.0, abs(move.rotation[0]))) for move in moves)
    whole = sorted(min(k, count - k) * 2 * math.pi / count for k in range(1, count))
    return count > 2 and np.allclose(turns, whole, atol=_RING)


def _between_plain_ends(given: Part, part: Part, within: float) -> Part:
    """Where its axis is one of the coordinates', between plain ends: parts that meet there go on meeting.

    given: the part before its numbers were made plain.
    """
    if within <= 0 or "height" not in _names(part.field) or "height" not in _names(given.field):
        return part
    axis = rotation_matrix(part.rotation)[:, 2]
    k = int(np.abs(axis).argmax())
    if abs(axis[k]) < 1 - _ALONG:
        return part
    height = float(given.field.height)  # type: ignore[attr-defined]
    # One grid for all, so that what was at one level stays there.
    digits = -math.floor(math.log10(within) + 0.1)
    low, high = (round(given.translation[k] + end * height / 2, digits) for end in (-1, 1))
    place = list(part.translation)
    place[k] = round((low + high) / 2, 12) + 0.0
    try:
        field: Any = dataclasses.replace(part.field, height=round(high - low, 12))  # type: ignore[type-var]
    except ParameterError:
        return part
    return dataclasses.replace(part, field=field, translation=(place[0], place[1], place[2]))


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


def plain_move(move: Similarity, within: float) -> Similarity:
    """A shift alone; the foot of a turn stays where the turn needs it."""
    if abs(move.rotation[0]) != 1.0:
        return move
    x, y, z = (plain(v, within) for v in move.translation)
    return dataclasses.replace(move, translation=(x, y, z))
