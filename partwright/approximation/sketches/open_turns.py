"""Sides of a cut that lie in the air, further out, arcs, too: no skin is left of what it goes around."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import product

import numpy as np

from partwright.approximation.sketches.ends import BEYOND, STEPS
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Revolution
from partwright.fields.profile import Side
from partwright.fields.profile_growth import with_moved_sides

_ALONG, _AROUND = 9, 12  # points along a side, and angles, that are looked at
_INSET = 0.04  # of a side's length, and of the angle, at their ends
_POINTS = 4000  # in what the cut takes more, which have to be air
_REACHES = (1.0, 1 / 4)  # of how far a side may go out: as far as there is room
_SHARES = (1.0, 1 / 4, 1 / 16)  # of that, where all of it would make a side vanish or cross others
_BURR = 1e-3  # unit lengths: how deep within the shape these may seem to lie


def with_open_turns(
    part: Part, field: Revolution, distance: Callable[[np.ndarray], np.ndarray], reach: float
) -> Part:
    """The cut with those sides of its profile further out that have nothing behind them, for any copy.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside. reach: how far,
    or a quarter of that.
    """
    share = np.linspace(_INSET, 1 - _INSET, _AROUND)
    turns = math.radians(field.angle) * share[:, None]

    def is_open(side: Side, by: float) -> bool:
        if side.centre is None and side.start[0] == side.end[0] == 0:  # the axis
            return False
        x, z = beside(side, by).T
        around = [np.cos(turns) * x, np.sin(turns) * x, np.broadcast_to(z, (_AROUND, len(z)))]
        return in_the_air(np.stack(around, axis=-1).reshape(-1, 3), part, distance)

    return with_grown_sides(part, field, lambda side: room(side, is_open, reach), distance)


def room(side: Side, is_open: Callable[[Side, float], bool], most: float) -> float:
    """How far a side may go out, unit lengths; 0 where it may not. is_open: whether there is nothing behind
    it up to a length."""
    return next((share * most for share in _REACHES if is_open(side, share * most)), 0.0)


def with_grown_sides(
    part: Part,
    field: Extrusion | Revolution,
    reach: Callable[[Side], float],
    distance: Callable[[np.ndarray], np.ndarray],
) -> Part:
    """The part with the sides of its profile as far out as each may go, arcs about their centres; as it is
    where that would take more than air."""
    by = [reach(side) for loop in field.profile.sides for side in loop]
    if not any(by):
        return part
    for share, tilted in product(_SHARES, (False, True)):
        try:
            profile = with_moved_sides(field.profile, [share * each for each in by], tilted)
            grown = dataclasses.replace(field, profile=profile)
        except ParameterError:  # its sides would cross, or its rims have no room
            continue
        low, high = grown.bounds()
        points = np.random.default_rng(0).uniform(low, high, (_POINTS, 3))
        more = points[(grown(points) < 0) & (field(points) >= 0)]
        if in_the_air(more, part, distance, _BURR):
            return dataclasses.replace(part, field=grown)
    return part


def in_the_air(
    points: np.ndarray, part: Part, distance: Callable[[np.ndarray], np.ndarray], burr: float = 0.0
) -> bool:
    """Whether points (N, 3) of a part's frame lie outside of the shape, or no deeper than a burr, in all its
    copies."""
    turned = (points @ rotation_matrix(copy.rotation).T + copy.translation for copy in part.copies)
    first, *others = turned
    if not (distance(first) > -burr).all():
        return False
    return not others or bool((distance(np.concatenate(others)) > -burr).all())


def beside(side: Side, reach: float) -> np.ndarray:
    """(N, 2) points to the right of a line or an arc, where the solid is not, up to a length."""
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
    return np.concatenate([on + reach / BEYOND * step * outwards for step in STEPS])
