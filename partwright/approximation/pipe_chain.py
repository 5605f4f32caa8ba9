"""Pipes as straight solids: a cylinder along each run, capsules along the chords of bends."""

from __future__ import annotations

import math
from collections.abc import Collection
from itertools import pairwise

import numpy as np

from partwright.approximation.convex import MOST_SEGMENTS
from partwright.assembly import Part, Similarity
from partwright.fields import Capsule, Cylinder, Field, Pipe
from partwright.fields.bent_path import Bend, perpendicular

_THIN = 0.125  # of the radius: how far chords may leave the arc of a bend, whatever is allowed
_MOST_SHORTER = 0.99  # of a capsule's length: it has to have one


def straight_rod(part: Part) -> Part | None:
    """A solid pipe without a bend as the cylinder that it is; None for any other part."""
    field = part.field
    if not isinstance(field, Pipe) or field.bore or len(field.bent_corners) > 2:
        return None
    return _cylinder(part, field.ends[0][0], field.ends[1][0], field.radius)


def has_narrow_bore(part: Part, allowed: float) -> bool:
    """Whether it is a tube whose walls are no further from any place of its bore than that."""
    return isinstance(part.field, Pipe) and 0 < part.field.bore <= allowed


def pipe_chain(part: Part, kinds: Collection[type[Field]], allowed: float) -> list[Part]:
    """A pipe, its bore filled, as cylinders and capsules that leave its path by no more than `allowed`.

    None of any other part, nor where a bend would take too many or `kinds` has no capsule.

    The balls at the ends of capsules fill the joints. What ends where the pipe does is a cylinder, flat there
    as the pipe is, or else a capsule that does not reach beyond."""
    field = part.field
    if not isinstance(field, Pipe) or Capsule not in kinds:
        return []
    chords: list[tuple[np.ndarray, np.ndarray, float]] = []  # from, to, and by how much the path turns there
    for piece in field.pieces:
        count, turn = 1, 0.0
        if isinstance(piece, Bend):
            off = min(allowed, _THIN * field.radius) / piece.radius
            step = 2 * math.acos(max(1 - off, 0.0))
            if piece.angle > MOST_SEGMENTS * step:
                return []
            count = math.ceil(piece.angle / step)
            turn = piece.angle / count
        places = piece.at(np.linspace(0.0, 1.0, count + 1))
        chords += [(a, b, turn) for a, b in pairwise(places)]
    return [
        _link(part, field.radius, chord, i == 0, i == len(chords) - 1, Cylinder in kinds)
        for i, chord in enumerate(chords)
    ]


def _link(
    part: Part,
    radius: float,
    chord: tuple[np.ndarray, np.ndarray, float],
    first: bool,
    last: bool,
    cylinders: bool,
) -> Part:
    """first, last: whether the pipe begins, or ends, with it."""
    start, end, turn = chord
    length = math.dist(start, end)
    way = (end - start) / length
    if cylinders and (first or last or not turn):
        beyond = radius * math.tan(turn / 2)  # to meet its neighbour on the outside of the bend
        return _cylinder(part, start - (not first) * beyond * way, end + (not last) * beyond * way, radius)
    short = min(radius, _MOST_SHORTER * length / (1 + (first and last)))
    start, end = start + first * short * way, end - last * short * way
    return _placed(part, Capsule(radius, math.dist(start, end)), start, end)


def _cylinder(part: Part, start: np.ndarray, end: np.ndarray, radius: float) -> Part:
    return _placed(part, Cylinder(radius, math.dist(start, end)), start, end)


def _placed(part: Part, field: Field, start: np.ndarray, end: np.ndarray) -> Part:
    """A solid about its z, from one place of the part's frame to another."""
    way = (end - start) / math.dist(start, end)
    across = perpendicular(way)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([across, np.cross(way, across), way], axis=1)
    pose[:3, 3] = (start + end) / 2
    place = part.pose @ Similarity.from_matrix(pose)
    return Part(field, place.translation, place.rotation, part.blend, part.name)
