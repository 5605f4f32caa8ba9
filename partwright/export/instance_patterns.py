"""How the copies of a repeated part follow from the first, as a person would put it: around an axis, at these
places, or each placed and turned for itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix

_SAME = 1e-9  # of the lengths that occur, and of entries of rotations

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Ring:
    """`count` copies by equal turns about the axis "x", "y" or "z" through a centre, the part first."""

    count: int
    axis: str
    centre: Vector


@dataclass(frozen=True)
class Row:
    """Copies turned alike at these places, the part's own first."""

    places: tuple[Vector, ...]


@dataclass(frozen=True)
class Poses:
    """Copies of which each is its own: parts without instances, the part itself first."""

    copies: tuple[Part, ...]


def pattern(part: Part) -> Ring | Row | Poses | None:
    """The plainest words for a part's copies; None for a part that is not repeated."""
    if not part.instances:
        return None
    copies = part.copies
    first = rotation_matrix(part.rotation)
    if all(np.abs(rotation_matrix(copy.rotation) - first).max() < _SAME for copy in copies):
        return Row(tuple(copy.translation for copy in copies))
    return _ring(part) or Poses(tuple(copies))


def _ring(part: Part) -> Ring | None:
    count = len(part.instances) + 1
    turns = [rotation_matrix(move.rotation) for move in part.instances]
    shifts = np.array([move.translation for move in part.instances])
    size = max(1.0, float(np.abs([copy.translation for copy in part.copies]).max()))
    for axis in range(3):
        if any(abs(turn[axis, axis] - 1) > _SAME for turn in turns):
            continue
        a, b = (axis + 1) % 3, (axis + 2) % 3
        steps = [np.arctan2(turn[b, a], turn[a, a]) / (2 * np.pi) * count % count for turn in turns]
        if not np.allclose(np.sort(steps), np.arange(1, count), rtol=0, atol=1e-6):
            return None
        # A turn R about the centre c shifts by c - R c.
        systems = [np.eye(3)[[a, b]][:, [a, b]] - turn[np.ix_([a, b], [a, b])] for turn in turns]
        centre = np.zeros(3)
        centre[[a, b]] = np.linalg.solve(systems[0], shifts[0, [a, b]])
        moved = np.array([centre - turn @ centre for turn in turns])
        if np.abs(moved - shifts).max() > 1e-6 * size:
            return None
        x, y, z = (0.0 if abs(c) < 1e-9 * size else float(f"{c:.12g}") for c in centre)
        return Ring(count, "xyz"[axis], (x, y, z))
    return None
