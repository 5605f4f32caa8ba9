"""Rigid moves that take one piece of a part to others like it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import Manifold

from partwright.approximation.sketches.candidate import Candidate
from partwright.assembly import Part, Similarity

_ALIKE = 0.15  # of the volume, that pieces may differ by; whether a copy fits is told by what it gains
_SAME = 0.05  # of the volume, that candidates may differ by which are the same elsewhere
_NEAR = 8e-3  # unit lengths: how far the move may miss the other piece's middle
_MOST = 200


def moves_between(
    body: Manifold, pieces: Sequence[Manifold], frames: Sequence[np.ndarray], whole: Manifold
) -> Iterator[Similarity]:
    """For each piece that is like the one that `body` stands for, the moves that may take that to it: along a
    line, or about an axis through the middle of the whole."""
    if body.is_empty() or not pieces:
        return
    own = min(pieces, key=lambda piece: _apart(body, piece))
    centre, volume, sides = _middle(own), own.volume(), _sides(own)
    about = _middle(whole)
    for other in pieces[:_MOST]:
        if other is own or abs(other.volume() - volume) > _ALIKE * volume:
            continue
        target = _middle(other)
        if np.abs(_sides(other) - sides).max() < _NEAR * 2:
            x, y, z = (target - centre).tolist()
            yield Similarity(translation=(x, y, z))
            continue
        for frame in frames:
            move = _turn(centre, target, frame[:, 2], about)
            if move is not None and np.linalg.norm(move(centre) - target) < _NEAR * 2:
                yield move
                break


def shifts_between(chosen: Candidate, others: Sequence[Candidate]) -> Iterator[Similarity]:
    """Along which others are the same solid elsewhere, also where one piece holds several: holes that a skin
    joins, or that meet."""
    middle, size = _box(chosen.part)
    for other in others[:_MOST]:
        if other is chosen or (other.sides, other.part.field.kind) != (chosen.sides, chosen.part.field.kind):
            continue
        if abs(other.volume - chosen.volume) > _SAME * chosen.volume:
            continue
        there, its = _box(other.part)
        if np.abs(its - size).max() < _NEAR and np.abs(there - middle).max() > _NEAR:
            x, y, z = (there - middle).tolist()
            yield Similarity(translation=(x, y, z))


def planes_between(body: Manifold, pieces: Sequence[Manifold]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Normals (3,) and points (3,) of the planes midway between the piece that `body` stands for and those
    that are as large."""
    if body.is_empty() or not pieces:
        return
    own = min(pieces, key=lambda piece: _apart(body, piece))
    centre, volume = _middle(own), own.volume()
    for other in pieces[:_MOST]:
        way = _middle(other) - centre
        far = float(np.linalg.norm(way))
        if other is not own and far > _NEAR and abs(other.volume() - volume) < _ALIKE * volume:
            yield way / far, (centre + _middle(other)) / 2


def _turn(start: np.ndarray, end: np.ndarray, axis: np.ndarray, about: np.ndarray) -> Similarity | None:
    """The turn about an axis that takes one point to another; None where none does."""
    a, b = start - about, end - about
    if abs(float((a - b) @ axis)) > _NEAR:
        return None
    a, b = a - axis * (a @ axis), b - axis * (b @ axis)
    if (
        min(np.linalg.norm(a), np.linalg.norm(b)) < _NEAR
        or abs(np.linalg.norm(a) - np.linalg.norm(b)) > _NEAR
    ):
        return None
    angle = math.atan2(float(np.cross(a, b) @ axis), float(a @ b))
    return Similarity.turn(axis.tolist(), angle, about.tolist())


def _apart(one: Manifold, other: Manifold) -> float:
    return float(np.linalg.norm(_middle(one) - _middle(other))) + abs(one.volume() - other.volume())


def _box(part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Middle and size (3,) of a part's box."""
    low, high = part.bounds()
    return (low + high) / 2, high - low


def _middle(body: Manifold) -> np.ndarray:
    return np.reshape(body.bounding_box(), (2, 3)).mean(axis=0)


def _sides(body: Manifold) -> np.ndarray:
    return np.ptp(np.reshape(body.bounding_box(), (2, 3)), axis=0)
