"""Parts that get longer, by the number that is their length in a direction."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.assembly.numbers import numbers_of, with_number
from partwright.assembly.similarity import rotation_matrix
from partwright.assembly.tree import Part
from partwright.errors import ParameterError
from partwright.fields import Profile, Revolution

_LONG = ("cylinder", "tube", "extrusion", "capsule")
_ALONG = 1e-3  # radians: axes that differ by less are parallel
_SAME = 2e-3  # of a profile's size: corners that are nearer lie at one height


def stretched(part: Part, axis: np.ndarray, by: float) -> Part | None:
    """Longer along the direction, or shorter by a negative length; None where no number of it is its length
    that way, or it has not as much to lose."""
    local = np.abs(axis @ rotation_matrix(part.rotation))
    k = int(local.argmax())
    if local[k] < 1 - _ALONG:
        return None
    if isinstance(part.field, Revolution) and k == 2:
        field = _longer(part.field, by)
        return None if field is None else dataclasses.replace(part, field=field)
    if part.field.kind == "box":
        number = f"size.{'xyz'[k]}"
    elif k == 2 and part.field.kind in _LONG:
        number = "height"
    else:
        return None
    length = numbers_of(part)[number] + by
    return with_number(part, number, length) if length > 0 else None


def _longer(field: Revolution, by: float) -> Revolution | None:
    """Longer along its axis, half at either end: what lies between goes with the wider end, as a counterbore
    keeps its depth. None where that would reach the other end."""
    loops = field.profile.loops
    x, y = field.profile.corners[:, 0], field.profile.corners[:, 1]
    low, high = float(y.min()), float(y.max())
    near = _SAME * field.profile.size
    widths = [float(x[np.abs(y - end) < near].max()) for end in (low, high)]
    edge = low + near if widths[1] >= widths[0] else high - near  # what lies beyond is the other end
    if y[y >= edge].min() + by <= y[y < edge].max():
        return None
    moved = [tuple((a, b + (by / 2 if b >= edge else -by / 2), c) for a, b, c in loop) for loop in loops]
    try:
        return dataclasses.replace(field, profile=Profile.of_loops(moved))
    except ParameterError:  # arcs cross, though their corners do not
        return None
