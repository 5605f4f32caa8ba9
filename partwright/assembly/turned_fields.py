"""Turns that a solid does not feel: any about the axis of what is round, half turns of a box, those after
which a profile is the same. A copy that is turned so is a copy that is moved."""

from __future__ import annotations

import numpy as np

from partwright.fields import Box, Extrusion, Field, HollowBox, Revolution
from partwright.fields.profile import Loop, Profile

_ROUND = ("cylinder", "cone", "frustum", "sphere", "capsule", "tube", "torus", "hollow_frustum")


def is_round(field: Field) -> bool:
    """Whether it is round about its own z."""
    return field.kind in _ROUND or (isinstance(field, Revolution) and field.full)


def is_same_turned(field: Field, turn: np.ndarray, within: float) -> bool:
    """Whether the solid, turned by (3, 3) about its own origin, is where it was.

    within: radians, or that share of its lengths, by which it may be off. False where nobody knows.
    """
    if np.abs(turn - np.eye(3)).max() <= within:
        return True
    upright = abs(turn[2, 2] - 1) <= within**2 + 1e-15 and np.abs(turn[:2, 2]).max() <= within
    if is_round(field):
        return upright
    axes = np.rint(turn)
    if isinstance(field, Box | HollowBox):
        size = np.array(field.size)
        swaps = np.abs(turn - axes).max() <= within
        same = swaps and bool(np.abs(np.abs(axes) @ size - size).max() <= within * size.max())
        return same and (isinstance(field, Box) or abs(axes[2, 2]) == 1)
    return isinstance(field, Extrusion) and upright and _is_same(field.profile, turn[:2, :2], within)


def _is_same(profile: Profile, turn: np.ndarray, within: float) -> bool:
    """Whether each loop of a profile lies on one of its loops when it is turned by (2, 2)."""
    near = within * profile.size
    return all(
        any(_lies_on(own, turn, other, near) for other in others)
        for others in ((profile.outline,), profile.holes)
        for own in others
    )


def _lies_on(loop: Loop, turn: np.ndarray, other: Loop, near: float) -> bool:
    """Whether a loop that is turned has the corners of another, begun at any of them."""
    if len(loop) != len(other):
        return False
    own, wanted = np.array(loop), np.array(other)
    own[:, :2] = own[:, :2] @ turn.T
    firsts = np.flatnonzero(np.abs(wanted[:, :2] - own[0, :2]).max(axis=1) <= near)
    return any(np.abs(np.roll(wanted, -first, axis=0) - own).max() <= near for first in firsts.tolist())
