"""Parts that end a little before what they run into, a handle's bend at a round wall: they go on as far as
their section lies in the shape, and cuts as far as theirs lies in the open."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.ends import EDGE, LONG, interior, longer, within
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cylinder, Extrusion, Revolution, Tube

_STEPS = 16  # in which a part goes on by its own narrower width, at most
_LATTICE = 16
_POINTS = 50  # of a section, about, that are looked at
_SHARES = np.arange(1, _STEPS + 1) / _STEPS

Points = NDArray[np.float64]
Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]


def lengthened(part: Part, added: bool, distance: Distance) -> Iterator[Part]:
    """The part with one end, and with the other, further out, where all copies may go on there.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside.
    """
    for side in (-1, 1):
        points, further = _beyond(part, side)
        if not len(points):
            continue
        placed = [points @ rotation_matrix(copy.rotation).T + copy.translation for copy in part.copies]
        off = distance(np.concatenate(placed).reshape(-1, 3).astype(np.float32))
        off = off.reshape(len(placed), _STEPS, -1)
        goes_on = ((off < 0) if added else (off > 0)).all(axis=(0, 2))
        steps = _STEPS if goes_on.all() else int(goes_on.argmin())
        if steps:
            yield further(steps / _STEPS)


def _beyond(part: Part, side: int) -> tuple[Points, Callable[[float], Part]]:
    """Points (steps, K, 3) of the part's frame where its section would come as it goes on at one of its ends,
    and the part with a share of all that; none of a part without such an end."""
    field = part.field
    if isinstance(field, Revolution) and not field.full:
        return _turn(part, field, side)
    upright = not isinstance(field, Extrusion) or not (field.taper or field.rims[side > 0].depth)
    if isinstance(field, LONG) and upright:
        return _span(part, field, side)
    return np.zeros((0, 0, 3)), lambda share: part


def _span(
    part: Part, field: Box | Cylinder | Tube | Extrusion, side: int
) -> tuple[Points, Callable[[float], Part]]:
    low, high = field.bounds()
    section, width = _some(interior(field, low, high)), float((high - low)[:2].min())
    heights = (high[2] if side > 0 else low[2]) + side * width * _SHARES
    levels = [np.column_stack([section, np.full(len(section), height)]) for height in heights]

    def further(share: float) -> Part:
        more = share * width
        x, y, z = (part.translation + rotation_matrix(part.rotation)[:, 2] * side * more / 2).tolist()
        return replace(part, field=longer(field, more), translation=(x, y, z))

    return np.stack(levels), further


def _turn(part: Part, field: Revolution, side: int) -> tuple[Points, Callable[[float], Part]]:
    low, high = field.profile.bounds()
    width = min(float((high - low).min()) / float(high[0]), math.radians(360.0 - field.angle))
    x, z = _half_section(field).T
    turns = (math.radians(field.angle) if side > 0 else 0.0) + side * width * _SHARES
    levels = [np.column_stack([np.cos(turn) * x, np.sin(turn) * x, z]) for turn in turns]

    def further(share: float) -> Part:
        more = share * width
        back = -more / 2 if side < 0 else 0.0  # half of the angle by which it begins earlier
        pose = part.pose @ Similarity(rotation=(math.cos(back), 0.0, 0.0, math.sin(back)))
        turned = replace(field, angle=field.angle + math.degrees(more))
        return replace(part, field=turned, rotation=pose.rotation)

    return np.stack(levels), further


def _half_section(field: Revolution) -> Points:
    """(K, 2) points of the profile, away from its edge where there are such."""
    whole = replace(field, angle=360.0)

    def depth(flat: Points) -> Points:
        return whole(np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]]))

    return _some(within(*field.profile.bounds(), depth, _LATTICE, EDGE))


def _some(section: Points) -> Points:
    return section[:: max(1, len(section) // _POINTS)]
