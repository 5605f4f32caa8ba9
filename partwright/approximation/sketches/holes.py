"""Holes of an extrusion's profile as parts that are cut from it: each form once, with a copy a hole."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.approximation.profile_parts import extruded_part
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion
from partwright.fields.profile import Loop, Profile, circle_of

_SAME = 2e-3  # of its size, by which holes that are alike may differ
_BEYOND = 0.03  # unit lengths: how far holes reach beyond what they go through


def holes_apart(part: Part) -> tuple[Part, tuple[Part, ...]]:
    """The part without holes that are round or come more than once, and what cuts these, each form once.

    Lengths in the unit frame. A part that is no extrusion, or tapers, stays as it is.
    """
    field = part.field
    if not isinstance(field, Extrusion) or field.taper or not field.profile.holes:
        return part, ()
    groups: list[list[Loop]] = []
    for loop in field.profile.holes:
        same = next((group for group in groups if _alike(group[0], loop)), None)
        if same is None:
            groups.append([loop])
        else:
            same.append(loop)
    apart = [group for group in groups if len(group) > 1 or circle_of(group[0]) is not None]
    if not apart:
        return part, ()
    frame, height = rotation_matrix(part.rotation), field.height
    middle = frame.T @ np.array(part.translation)
    kept = tuple(loop for group in groups if group not in apart for loop in group)

    def extruded(profile: Profile, more: float) -> Part:
        low, high = middle[2] - height / 2 - more, middle[2] + height / 2 + more
        return extruded_part(profile.moved(middle[:2]), frame, low, high)

    body = extruded(Profile(field.profile.outline, kept), 0.0)
    holes = []
    for first, *others in apart:
        own = [_shift(frame, _middle(other) - _middle(first)) for other in others]
        moves = [*own, *(move @ inner for move in part.instances for inner in (Similarity(), *own))]
        holes.append(dataclasses.replace(extruded(Profile(first), _BEYOND), instances=tuple(moves)))
    return dataclasses.replace(body, instances=part.instances, name=part.name), tuple(holes)


def _middle(loop: Loop) -> np.ndarray:
    """(2,) of its box."""
    lower, upper = Profile(loop).bounds()
    return np.asarray((lower + upper) / 2)


def _alike(one: Loop, other: Loop) -> bool:
    """Whether a shift takes one loop to the other, whichever corner each begins with."""
    round_, also = circle_of(one), circle_of(other)
    if round_ is not None and also is not None:
        return abs(round_[0] - also[0]) < _SAME * round_[0]
    if len(one) != len(other) or round_ is not None or also is not None:
        return False
    a, b = (np.array(loop) - (*_middle(loop), 0.0) for loop in (one, other))
    near = _SAME * float(np.ptp(a[:, :2], axis=0).max())
    scale = np.array([1.0, 1.0, near / 0.02])  # bulges may differ by 0.02
    return any(np.abs((np.roll(b, k, axis=0) - a) * scale).max() < near for k in range(len(b)))


def _shift(frame: np.ndarray, offset: np.ndarray) -> Similarity:
    x, y, z = (frame[:, :2] @ offset).tolist()
    return Similarity(translation=(x, y, z))
