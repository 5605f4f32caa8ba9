"""Samples of one shape, which a reconstruction is to come close to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from partwright.assembly.similarity import rotation_matrix
from partwright.shapes import Shape

SURFACE = 2048  # points on it
NEAR = (0.005**0.5, 0.0005**0.5)  # section B.4 gives variances


@dataclass(frozen=True)
class Target:
    """Samples of one shape, unit frame: points (N, 3), sdf (N,), and where known the nearest part (N,) and
    points on the surface (M, 3), which an encoder looks at."""

    points: Tensor
    sdf: Tensor
    part: Tensor | None = None
    surface: Tensor | None = None

    @classmethod
    def of_shape(cls, shape: Shape, count: int = 40_000, seed: int = 0) -> Target:
        """Of any shape that comes in: near its surface with the paper's two variances, and around it."""
        samples = shape.samples(round(0.95 * count), round(0.05 * count), seed, NEAR)
        surface = torch.tensor(shape.unit_surface(SURFACE, seed).points)
        return cls(torch.tensor(samples.points), torch.tensor(samples.distance), surface=surface)

    def turned(self, turn: tuple[float, float, float, float]) -> Target:
        """The same shape in the frame that `turn`, a unit quaternion (w, x, y, z), leads to this one."""
        matrix = torch.tensor(rotation_matrix(turn), dtype=self.points.dtype)
        surface = None if self.surface is None else self.surface @ matrix
        return replace(self, points=self.points @ matrix, surface=surface)

    def halves(self) -> tuple[Tensor, Tensor]:
        """Rows that lie inside and outside; each draw takes half of its points from either."""
        inside = self.sdf < 0
        return inside.nonzero().squeeze(1), (~inside).nonzero().squeeze(1)
