"""Turns that a solid does not feel: any about the axis of what is round, half turns of a box, those after
which a profile is the same. A copy that is turned so is a copy that is moved."""

from __future__ import annotations

import numpy as np

from partwright.fields import Box, Extrusion, Field, HollowBox, Revolution
from partwright.fields.profile import Profile, is_same_loop

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
    corners = [[np.array(loop) for loop in loops] for loops in ((profile.outline,), profile.holes)]

    def turned(loop: np.ndarray) -> np.ndarray:
        return np.column_stack([loop[:, :2] @ turn.T, loop[:, 2]])

    return all(
        any(is_same_loop(turned(own), other, near, near) for other in loops)
        for loops in corners
        for own in loops
    )
