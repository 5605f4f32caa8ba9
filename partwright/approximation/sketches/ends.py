"""Where a part ends in the open, a cut in the air, a boss within what it stands on: there it goes on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from partwright.approximation.sketches.directions import frame_along
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Cylinder, Extrusion, Field, Pipe, Tube

BEYOND = 0.03
"""Unit lengths: how far an open end goes on at most."""
BARELY = 1e-3
"""Unit lengths: the same of the wide end of leaning walls, which move with it, and by less than is seen."""
STEPS = (0.004, 0.012, 0.02, BEYOND + 0.004)
"""Unit lengths beyond an end, where it has to be open."""
LONG = Box, Cylinder, Tube, Extrusion
"""What has ends along z."""
_LATTICE = 24
_FEW = 16
_EXACT = 1e-9
EDGE = 0.004  # unit lengths: so near to its edge an end is not looked at


def typed_reach(scale: float) -> float:
    """Unit lengths that open ends go on: `BEYOND`, or so much less that it is a number of one digit in the
    shape's own units, of which one is `scale` unit lengths. A cut of 5 mm through a plate is then 7 or 9 mm
    long, and not 8.96."""
    most = BEYOND / scale
    digit = 10.0 ** math.floor(math.log10(most))
    return math.floor(most / digit + _EXACT) * digit * scale


def with_open_ends(
    part: Part, added: bool, distance: Callable[[np.ndarray], np.ndarray], reach: float = BEYOND
) -> Part:
    """The part, longer where all beyond its end is empty (of a cut) or solid (of what is added).

    So no skin is left over a hole and no slit under a boss, whatever moves a little. distance: (N,) of the
    shape at points (N, 3), unit lengths like the part, negative inside. reach: how much longer, at most
    `BEYOND`. Only ends along z of a box, a cylinder, a tube or an extrusion, and those of a pipe; all copies
    have to agree.
    """
    field = part.field
    if isinstance(field, Pipe):
        return _with_open_pipe_ends(part, field, -1.0 if added else 1.0, distance, reach)
    if not isinstance(field, LONG):
        return part
    low, high = field.bounds()
    flat = interior(field, low, high)
    if not len(flat):
        return part
    looks = flat[::_FEW], flat  # most ends that are closed show it in a few points
    sign = -1.0 if added else 1.0

    def is_open(side: float) -> bool:
        if isinstance(field, Extrusion) and field.rims[side > 0].depth:
            return False
        end = high[2] if side > 0 else low[2]
        for points in looks:
            beyond = [np.column_stack([points, np.full(len(points), end + side * step)]) for step in STEPS]
            there = np.concatenate(beyond)
            placed = [there @ rotation_matrix(copy.rotation).T + copy.translation for copy in part.copies]
            if (sign * distance(np.concatenate(placed)) < 0).any():
                return False
        return True

    leans = isinstance(field, Extrusion) and field.taper > 0
    up, down = reach * is_open(1.0), (BARELY if leans else reach) * is_open(-1.0)
    if not up and not down:
        return part
    axis = rotation_matrix(part.rotation)[:, 2]
    x, y, z = (np.array(part.translation) + axis * (up - down) / 2).tolist()
    try:
        return dataclasses.replace(part, field=longer(field, up + down), translation=(x, y, z))
    except ParameterError:  # a leaning side would vanish
        return part


def _with_open_pipe_ends(
    part: Part, field: Pipe, sign: float, distance: Callable[[np.ndarray], np.ndarray], reach: float
) -> Part:
    path, size = field.corners, np.full(2, field.radius)

    def depth(flat: np.ndarray) -> np.ndarray:
        away = np.linalg.norm(flat, axis=1)
        return np.maximum(away - field.radius, field.bore - away)

    flat = within(-size, size, depth, _LATTICE, min(EDGE, 0.4 * field.wall))
    for end, (place, out) in zip((0, -1), field.ends, strict=True):
        frame = frame_along(out)
        there = np.concatenate([place + flat @ frame[:, :2].T + step * out for step in STEPS])
        placed = [there @ rotation_matrix(copy.rotation).T + copy.translation for copy in part.copies]
        if not (sign * distance(np.concatenate(placed)) < 0).any():
            path[end, :3] += reach * out
    return dataclasses.replace(part, field=field.with_corners(path))


def interior(field: Field, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(K, 2) points of the middle section of what has ends along z, away from the edge where there are such.
    low, high: (3,) its bounds."""

    def depth(flat: np.ndarray) -> np.ndarray:
        return field(np.column_stack([flat, np.zeros(len(flat))]))

    return within(low[:2], high[:2], depth, _LATTICE, min(EDGE, 0.4 * float(high[2])))


def within(
    low: np.ndarray, high: np.ndarray, depth: Callable[[np.ndarray], np.ndarray], lattice: int, edge: float
) -> np.ndarray:
    """(K, 2) points of a lattice between two corners (2,) that lie in a section, by an edge from its border
    where there are such. depth: (N,) of points (N, 2), negative in the section."""
    steps = (np.arange(lattice) + 0.5) / lattice
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = low + grid * (high - low)
    deep = depth(flat)
    inner = flat[deep < -edge]
    return inner if len(inner) else flat[deep < 0]


def longer(field: Box | Cylinder | Tube | Extrusion, more: float) -> Field:
    """By a length along z."""
    if isinstance(field, Box):
        x, y, z = field.size
        return Box((x, y, z + more))
    return dataclasses.replace(field, height=field.height + more)
