"""How well an assembly agrees with what it stands for, in volume.

Cleaned faces lie on round numbers, and so may the centres of a grid's cells: moved by a hair, a plate of
eight cells would lose or win one of them. So each cell is asked at a random place of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.metrics.iou import occupancy_iou
from partwright.shapes import Shape

_CELLS = 250_000
_ROOM = 0.01  # of the longest side, around what the assembly stands for


@dataclass(frozen=True)
class Agreement:
    """Of one assembly."""

    iou: float
    """With the shape, or with the given assembly where there is no shape."""
    mean_deviation: float
    """Over points of both surfaces, own units."""
    parts: int
    """Leaves."""

    def to_dict(self) -> dict[str, float]:
        return {"iou": self.iou, "mean_deviation": self.mean_deviation, "parts": self.parts}


@dataclass(frozen=True)
class VolumeSamples:
    """A place (N, 3) in each cell around a solid, own units, and which lie inside (N,)."""

    points: NDArray[np.float64]
    inside: NDArray[np.bool_]

    @classmethod
    def of(cls, target: Assembly | Shape) -> Self:
        lower, upper = target.bounds()
        room = _ROOM * float((upper - lower).max())
        points = _a_place_a_cell(lower - room, upper + room)
        distance = target.signed_distance(points) if isinstance(target, Shape) else target.distance(points)
        return cls(points, distance < 0)

    def iou(self, assembly: Assembly) -> float:
        return occupancy_iou(assembly.distance(self.points) < 0, self.inside)


def _a_place_a_cell(lower: NDArray[np.float64], upper: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) one in each of about `_CELLS` cells, as good as cubes, that fill a box."""
    extent = upper - lower
    side = float((extent.prod() / _CELLS) ** (1 / 3))
    counts = np.maximum(np.rint(extent / side), 1).astype(int)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    within = np.random.default_rng(0).uniform(size=cells.shape)
    return np.asarray(lower + (cells + within) * (extent / counts))
