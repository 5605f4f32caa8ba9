"""Coordinates that parts of an assembly share, made plain together: walls that are one in the shape stay one.

Where numbers of parts become plain each for itself, faces that lay in one plane come to lie a last digit
apart.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from partwright.approximation.plain import plain
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Extrusion, Revolution
from partwright.fields.profile import Profile, circle_of

_ALONG = 1e-9  # of a cosine


@dataclass(frozen=True)
class _Level:
    """Coordinates that become one number. shared: whether several parts have them."""

    low: float
    high: float
    number: float
    shared: bool


@dataclass(frozen=True)
class Levels:
    """What coordinates of some parts become, for each axis of the world, in order. within: by which they are
    moved at most, own units."""

    within: float
    axes: tuple[list[_Level], list[_Level], list[_Level]]

    @classmethod
    def of(cls, parts: Iterable[Part], within: float) -> Levels:
        """Those along one axis that differ by at most `within` become one number; of a part with several
        copies those of the first."""
        found: tuple[list[tuple[float, int]], ...] = ([], [], [])
        for i, part in enumerate(parts):
            for copy in part.copies if len(part.instances) == 1 else (part,):
                for axis, value in _coordinates(copy):
                    found[axis].append((value, i))
        x, y, z = (_levels(sorted(own), within) for own in found)
        return cls(within, (x, y, z))

    def number(self, axis: int, value: float) -> float:
        """What a coordinate becomes; by itself, where none of the parts has it."""
        level = self._at(axis, value)
        return plain(value, self.within) if level is None else level.number

    def shared(self, axis: int, value: float) -> float | None:
        """What a coordinate becomes that several parts have; None of others."""
        level = self._at(axis, value)
        return level.number if level is not None and level.shared else None

    def _at(self, axis: int, value: float) -> _Level | None:
        own = self.axes[axis]
        k = bisect_right(own, value, key=lambda level: level.low) - 1
        return own[k] if k >= 0 and value <= own[k].high else None


def _levels(values: list[tuple[float, int]], within: float) -> list[_Level]:
    """Of coordinates in order, each with the number of its part."""
    groups: list[list[tuple[float, int]]] = []
    for value, part in values:
        if groups and value - groups[-1][0][0] <= within:
            groups[-1].append((value, part))
        else:
            groups.append([(value, part)])
    found = []
    for group in groups:
        low, high = group[0][0], group[-1][0]
        number = plain((low + high) / 2, within - (high - low) / 2)
        found.append(_Level(low, high, number, len({part for _, part in group}) > 1))
    return found


def along(part: Part) -> list[tuple[int, int, float]]:
    """Which of its own axes lie along which of the world's, and which way."""
    found = []
    for own, column in enumerate(rotation_matrix(part.rotation).T):
        k = int(np.abs(column).argmax())
        if abs(column[k]) >= 1 - _ALONG:
            found.append((own, k, math.copysign(1.0, float(column[k]))))
    return found


def walls(profile: Profile, axis: int) -> Iterator[float]:
    """Where a profile has sides across one of its axes."""
    same = _ALONG * profile.size
    for sides in profile.sides:
        for side in sides:
            if side.centre is None and abs(side.start[axis] - side.end[axis]) <= same:
                yield side.start[axis]


def slanting_ends(profile: Profile, axis: int) -> Iterator[float]:
    """Where sides that lie along none of a profile's axes begin and end: two parts have such a wall in common
    where they have its ends."""
    same = _ALONG * profile.size
    for sides in profile.sides:
        for side in sides:
            way = np.abs(np.subtract(side.end, side.start))
            if side.centre is None and way.min() > same:
                yield side.start[axis]
                yield side.end[axis]


def centres(profile: Profile, axis: int) -> Iterator[float]:
    """Of its round holes, and its outline where that is a circle."""
    return (round_[1][axis] for loop in profile.loops if (round_ := circle_of(loop)))


def _coordinates(part: Part) -> Iterator[tuple[int, float]]:
    """Of the part without its copies: world axes and values, of its ends, its walls, the ends of slanting
    ones, and axes of what is round."""
    if not isinstance(part.field, Box | Extrusion):
        yield from enumerate(part.translation)
    for own, k, sign in along(part):
        for value in _own_coordinates(part, own):
            yield k, part.translation[k] + sign * value


def _own_coordinates(part: Part, axis: int) -> Iterator[float]:
    field = part.field
    if isinstance(field, Box):
        yield from (-field.size[axis] / 2, field.size[axis] / 2)
    elif isinstance(field, Revolution):
        if axis == 2:
            yield from (y for loop in field.profile.loops for _, y, _ in loop)
    elif axis == 2 and (height := getattr(field, "height", None)) is not None:
        yield from (-height / 2, height / 2)
    elif axis < 2 and isinstance(field, Extrusion):
        yield from walls(field.profile, axis)
        yield from slanting_ends(field.profile, axis)
        yield from centres(field.profile, axis)
