"""Numbers of a profile by name: where its corners lie, the same for all that lie at one place."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TypeGuard

import numpy as np

from partwright.fields import Extrusion, Field, Profile, Revolution
from partwright.fields.profile import Loop, loop_of

PREFIX = "profile."
SAME_PLACE = 1e-5
"""Of the profile's size, by which corners at one place may differ."""


def profile_numbers(field: Field) -> dict[str, float]:
    """Of a revolution the distinct distances of corners from the axis and their heights, from the lowest on
    ("profile.radius.1", "profile.diameter.1", "profile.y.1"); of an extrusion the places of its sides along x
    and y ("profile.x.1"). Of other fields none."""
    if not _has_profile(field):
        return {}
    xs, ys = _places(field)
    found: dict[str, float] = {}
    if isinstance(field, Revolution):
        for k, x in enumerate(xs, start=1):
            found |= {f"{PREFIX}radius.{k}": x, f"{PREFIX}diameter.{k}": 2 * x}
    else:
        found |= {f"{PREFIX}x.{k}": x for k, x in enumerate(xs, start=1)}
    return found | {f"{PREFIX}y.{k}": y for k, y in enumerate(ys, start=1)}


def with_profile_numbers(field: Field, values: Mapping[str, float]) -> Field:
    """The field with some of its numbers, counted as it is given: all corners there move.

    Raises:
        ParameterError: sides then cross, or the profile crosses the axis.
    """
    assert _has_profile(field)
    places, near = _places(field), SAME_PLACE * field.profile.size
    moves: list[tuple[int, float, float]] = []  # axis, from where, to where
    for number, value in values.items():
        kind, _, index = number.removeprefix(PREFIX).partition(".")
        axis = int(kind == "y")
        moves.append((axis, places[axis][int(index) - 1], value / 2 if kind == "diameter" else value))

    def moved(loop: Loop) -> Loop:
        given = np.array(loop)
        corners = given.copy()
        for axis, place, value in moves:
            corners[np.abs(given[:, axis] - place) < near, axis] = value
        return loop_of(corners)

    profile = Profile.of_loops([moved(loop) for loop in field.profile.loops])
    return dataclasses.replace(field, profile=profile)


def _has_profile(field: Field) -> TypeGuard[Extrusion | Revolution]:
    return isinstance(field, Extrusion | Revolution)


def _places(field: Extrusion | Revolution) -> tuple[list[float], list[float]]:
    """Of corners along x and y, ascending: all of a revolution's that are off the axis; of an extrusion's,
    where a line runs across."""
    near = SAME_PLACE * field.profile.size
    x, y = ([float(v) for v in column] for column in field.profile.corners[:, :2].T)
    if isinstance(field, Extrusion):
        lines = [side for loop in field.profile.sides for side in loop if side.centre is None]
        x, y = ([s.start[k] for s in lines if abs(s.start[k] - s.end[k]) < near] for k in (0, 1))
    else:
        x = [value for value in x if value > near]
    return _distinct(x, near), _distinct(y, near)


def _distinct(values: list[float], near: float) -> list[float]:
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] >= near:
            kept.append(value)
    return kept
