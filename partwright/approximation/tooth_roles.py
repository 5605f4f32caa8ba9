"""Names of what stands around an axis again and again, teeth, blades, and the gaps between teeth, or in a
row: fins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.chains import circle_through
from partwright.assembly import Node, Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder

Floats = NDArray[np.float64]

GAP = "tooth_gap"
_FEWEST, _FEW = 5, 8  # of a fan's blades, and of a wheel's teeth
_SAME = 1e-3  # of the part's size: how far copies may be off a turn
_STEPS = 200
_ROW = 3  # others beside one that is a fin, at least
_EDGE_POINTS = 16  # along an edge of a fin
_BEYOND = 0.1  # of a fin's thickness: how far in and out of its edge it is looked at what is there
_HELD = 0.5  # of those points, at least, that are in what it stands on
_LONG = 3.0  # a blade's length over its width, at least


def tooth_role(part: Part, cut_from: Node | None, beside: Sequence[Node] = ()) -> str | None:
    """What a part is called that is there again in turns about an axis; None where it is something else, such
    as a bolt hole, which has the body all around it. cut_from: what it is cut from, if it is; beside: what
    else is."""
    axis = _axis(part)
    if axis is None:
        return None
    about, direction = axis
    middle = part.copies[0].bounds().mean(axis=0)
    outward = middle - about
    outward = outward - direction * float(outward @ direction)
    if np.linalg.norm(outward) < _SAME * _size(part):
        return None
    outward = outward / np.linalg.norm(outward)
    ends = _ends(part, middle, outward)
    few = len(part.copies) < _FEW
    if cut_from is not None:
        is_open = np.logical_or.reduce([cut_from.distance(ends) > 0, *(o.distance(ends) < 0 for o in beside)])
        return GAP if is_open.any() and not few else None
    sideways = _ends(part, middle, np.cross(direction, outward))
    length, width = (float(np.linalg.norm(one - other)) for one, other in (ends, sideways))
    return "blade" if length > _LONG * width else None if few else "tooth"


def is_fin(part: Part, others: Sequence[Node]) -> bool:
    """Whether a plate is there again and again beside its broad sides, and stands with an edge on or in what
    else is added, free at the opposite one: boards between two sides are none, nor are slats or washers."""
    low, high = part.field.bounds()
    sides = np.asarray(high - low)
    if not np.isfinite(sides).all():
        return False
    thin = int(sides.argmin())
    across = rotation_matrix(part.rotation)[:, thin]
    ways = np.array([move.translation for move in part.instances if move.rotation == (1.0, 0.0, 0.0, 0.0)])
    if len(ways) < _ROW or not others:
        return False
    aside = np.linalg.norm(ways - np.outer(ways @ across, across), axis=1)
    if int((aside < _SAME * _size(part)).sum()) < _ROW:
        return False
    held = [[_is_held(part, thin, way, end, others) for end in (0, 1)] for way in range(3) if way != thin]
    return any(map(any, held)) and not any(map(all, held))


def _is_held(part: Part, thin: int, way: int, end: int, others: Sequence[Node]) -> bool:
    """Whether others have the edge of a plate at one end of its box along axis `way`. thin: the axis along
    which it is so. What is round has hardly an edge there."""
    bounds = np.array(part.field.bounds())
    low, high = bounds
    along = 3 - thin - way
    local = np.repeat((low + high)[None] / 2, _EDGE_POINTS, axis=0)
    local[:, along] = low[along] + (np.arange(_EDGE_POINTS) + 0.5) / _EDGE_POINTS * (high - low)[along]
    step = np.zeros(3)
    step[way] = (2 * end - 1) * _BEYOND * float((high - low)[thin])
    local[:, way] = bounds[end, way]
    within, beyond = part.pose(local - step), part.pose(local + step)
    there = [other.distance(points) < 0 for other in others for points in (within, beyond)]
    own = part.copies[0].distance(within) < 0
    return float((own & np.logical_or.reduce(there)).mean()) >= _HELD


def _axis(part: Part) -> tuple[Floats, Floats] | None:
    """A point (3,) on the axis about which all copies are turned, and its direction; None where there are too
    few, or they are moved otherwise."""
    moves = part.instances
    if len(moves) + 1 < _FEWEST:
        return None
    size = _size(part)
    if isinstance(part.field, Cylinder):  # which is the same turned within itself
        frame = rotation_matrix(part.rotation)
        middles = np.array([copy.translation for copy in part.copies]) @ frame
        (x, y), _, off = circle_through(middles[:, :2])
        level = float(np.ptp(middles[:, 2])) < _SAME * size
        return (frame @ (x, y, 0.0), frame[:, 2]) if level and off < _SAME * size else None
    turn = np.array(moves[0].rotation[1:])
    if not turn.any():
        return None
    direction = turn / np.linalg.norm(turn)
    matrix = np.eye(3) - rotation_matrix(moves[0].rotation)
    about = np.linalg.lstsq(matrix, np.array(moves[0].translation), rcond=None)[0]
    on_axis = np.array([about, about + size * direction])
    stay = all(np.abs(move(on_axis) - on_axis).max() < _SAME * size for move in moves)
    return (about, direction) if stay else None


def _size(part: Part) -> float:
    return float(np.ptp(part.bounds(), axis=0).max())


def _ends(part: Part, middle: Floats, direction: Floats) -> Floats:
    """(2, 3) where a line through its middle leaves the part itself, at either end."""
    alone = part.copies[0]
    reach = float(np.linalg.norm(np.ptp(alone.bounds(), axis=0)))
    along = np.linspace(-reach, reach, 2 * _STEPS + 1)
    within = along[alone.distance(middle + along[:, None] * direction) < 0]
    first, last = (within.min(), within.max()) if len(within) else (0.0, 0.0)
    return middle + np.array([[first], [last]]) * direction
