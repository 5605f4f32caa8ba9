"""Rings that make a hole narrower for a part of its depth: no bodies, as that is drawn as a counterbore."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion, Field, Revolution, Tube
from partwright.fields.profile import Profile, circle

_DEEP = 8e-3  # unit lengths within the shape, from which on a place is none of its walls
_AROUND, _UP = 8, (-0.3, 0.0, 0.3)  # angles, and shares of the height, at which a ring's outside is looked at


def lines_a_hole(part: Part, distance: Callable[[np.ndarray], np.ndarray]) -> bool:
    """Whether a part has a hole, and the shape goes on all around it.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside.
    """
    around = _outside_of_ring(part.field)
    if not len(around):
        return False
    places = around @ rotation_matrix(part.rotation).T + part.translation
    return bool((distance(places.astype(np.float32)) < -_DEEP).all())


def _outside_of_ring(field: Field) -> np.ndarray:
    """(N, 3) on the outer walls of what has a hole along z; none of others."""
    if isinstance(field, Revolution):
        outer = [side for side in field.profile.sides[0] if side.end[1] - side.start[1] > 0]
        if not field.full or min(x for x, _, _ in field.profile.outline) <= 0:
            return np.zeros((0, 3))
        x, z = np.array([side.middle for side in outer]).T
        turns = 2 * math.pi * np.arange(_AROUND)[:, None] / _AROUND
        ring = [x * np.cos(turns), x * np.sin(turns), np.broadcast_to(z, (_AROUND, len(z)))]
        return np.stack(ring, axis=-1).reshape(-1, 3)
    if isinstance(field, Tube):
        outline = Profile(circle(field.radius))
    elif isinstance(field, Extrusion) and field.profile.holes and not field.taper:
        outline = Profile(field.profile.outline)
    else:
        return np.zeros((0, 3))
    flat = np.array([place for side in outline.sides[0] for place in (side.start, side.middle)])
    return np.concatenate([np.column_stack([flat, np.full(len(flat), z * field.height)]) for z in _UP])
