"""Sides of a cut that lie in the air, further out, arcs, too: no skin is left of what it goes around."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from partwright.approximation.sketches.ends import BEYOND, STEPS
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Revolution
from partwright.fields.profile import Side
from partwright.fields.profile_growth import grown_profile

_ALONG, _AROUND = 9, 12  # points along a side, and angles, that are looked at
_INSET = 0.04  # of a side's length, and of the angle, at their ends
_POINTS = 4000  # in what the cut takes more, which have to be air
_BURR = 1e-3  # unit lengths: how deep within the shape these may seem to lie


def with_open_turns(part: Part, field: Revolution, distance: Callable[[np.ndarray], np.ndarray]) -> Part:
    """The cut with those sides of its profile further out that have nothing behind them, for any copy.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside.
    """
    share = np.linspace(_INSET, 1 - _INSET, _AROUND)
    turns = math.radians(field.angle) * share[:, None]

    def is_open(side: Side) -> bool:
        if side.centre is None and side.start[0] == side.end[0] == 0:  # the axis
            return False
        x, z = beside(side).T
        around = [np.cos(turns) * x, np.sin(turns) * x, np.broadcast_to(z, (_AROUND, len(z)))]
        return in_the_air(np.stack(around, axis=-1).reshape(-1, 3), part, distance)

    return with_grown_sides(part, field, is_open, distance)


def with_grown_sides(
    part: Part,
    field: Extrusion | Revolution,
    is_open: Callable[[Side], bool],
    distance: Callable[[np.ndarray], np.ndarray],
) -> Part:
    """The part with the open sides of its profile further out, arcs about their centres; as it is where that
    would take more than air."""
    sides = [side for loop in field.profile.sides for side in loop]
    still = [i for i, side in enumerate(sides) if not is_open(side)]
    if len(still) == len(sides):
        return part
    try:
        grown = dataclasses.replace(field, profile=grown_profile(field.profile, BEYOND, still))
    except ParameterError:  # its sides would cross, or its rims have no room
        return part
    low, high = grown.bounds()
    points = np.random.default_rng(0).uniform(low, high, (_POINTS, 3))
    more = points[(grown(points) < 0) & (field(points) >= 0)]
    return dataclasses.replace(part, field=grown) if in_the_air(more, part, distance, _BURR) else part


def in_the_air(
    points: np.ndarray, part: Part, distance: Callable[[np.ndarray], np.ndarray], burr: float = 0.0
) -> bool:
    """Whether points (N, 3) of a part's frame lie outside of the shape, or no deeper than a burr, in all its
    copies."""
    return all(
        bool((distance(points @ rotation_matrix(copy.rotation).T + copy.translation) > -burr).all())
        for copy in part.copies
    )


def beside(side: Side) -> np.ndarray:
    """(N, 2) points to the right of a line or an arc, where the solid is not."""
    share = np.linspace(_INSET, 1 - _INSET, _ALONG)[:, None]
    start = np.array(side.start)
    if side.centre is None:
        way = np.subtract(side.end, start)
        on, outwards = start + share * way, np.array([way[1], -way[0]]) / np.linalg.norm(way)
    else:
        spoke = start - side.centre
        turn = math.atan2(spoke[1], spoke[0]) + share * side.sweep
        round_ = np.hstack([np.cos(turn), np.sin(turn)])
        on, outwards = side.centre + side.radius * round_, math.copysign(1.0, side.sweep) * round_
    return np.concatenate([on + step * outwards for step in STEPS])
