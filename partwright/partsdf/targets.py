"""Samples of one shape, which a reconstruction is to come close to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION, Similarity, quaternion_product, rotation_matrix
from partwright.errors import SettingError
from partwright.partsdf.config import LossSettings
from partwright.partsdf.losses import clamped_error
from partwright.shapes import Shape

SURFACE = 2048  # points on it
_APART = 2.0  # mean distances between neighbours: about the side of the square that a point stands for
NEAR = (0.005**0.5, 0.0005**0.5)  # section B.4 gives variances


@dataclass(frozen=True)
class Target:
    """Samples of one shape, unit frame: points (N, 3), sdf (N,), and where known the nearest part (N,) and
    points on the surface (M, 3), which an encoder looks at.

    low: (N,) where nothing but points of the surface is known, not what is inside: sdf is then the distance
    from them, and the surface is at least `low` and at most that far. count: then, of these points.

    shape: that was sampled, where it may be asked for more; turn: the unit quaternion (w, x, y, z) that leads
    to its unit frame.
    """

    points: Tensor
    sdf: Tensor
    part: Tensor | None = None
    surface: Tensor | None = None
    low: Tensor | None = None
    count: int = 0
    shape: Shape | None = None
    turn: Quaternion = NO_ROTATION

    @classmethod
    def of_shape(cls, shape: Shape, count: int = 40_000, seed: int = 0) -> Target:
        """Of any shape that comes in: near its surface with the paper's two variances, and around it."""
        samples = shape.samples(round(0.95 * count), round(0.05 * count), seed, NEAR)
        surface = torch.tensor(shape.unit_surface(SURFACE, seed).points)
        return cls(torch.tensor(samples.points), torch.tensor(samples.distance), surface=surface, shape=shape)

    @classmethod
    def of_points(cls, points: np.ndarray, count: int = 40_000, seed: int = 0) -> Target:
        """Of points (M, 3) of a surface, unit frame: half of the samples are these, the rest are around."""
        rng = np.random.default_rng(seed)
        tree = cKDTree(points)
        on = points[rng.integers(len(points), size=count // 2)]
        many = count - len(on)
        spread = rng.choice(NEAR, (many, 1)) * rng.standard_normal((many, 3))
        near = points[rng.integers(len(points), size=many)] + spread
        near[: many // 10] = rng.uniform(-1, 1, (many // 10, 3))
        away = np.concatenate([np.zeros(len(on)), tree.query(near)[0]])
        # A point that is as far away as the surface is from the next point tells nothing of its distance.
        apart = _APART * float(np.mean(tree.query(points, k=2)[0][:, 1]))
        low = np.sqrt(np.maximum(away**2 - apart**2, 0))
        order = rng.permutation(count)  # so that any run of rows is a fair subset
        samples, away, low = np.concatenate([on, near])[order], away[order], low[order]
        surface = points[rng.permutation(len(points))[:SURFACE]]
        known = (torch.from_numpy(a.astype(np.float32)) for a in (samples, away, surface, low))
        return cls(next(known), next(known), surface=next(known), low=next(known), count=len(points))

    @classmethod
    def seen_in(cls, shape: Shape, seed: int = 0) -> Target:
        """Of what the shape came as: its points, where these are all that was given, else its surface."""
        if shape.points is None:
            return cls.of_shape(shape, seed=seed)
        return cls.of_points(shape.frame.to_unit(shape.points), seed=seed)

    def error(self, whole: Tensor, rows: Tensor, losses: LossSettings) -> Tensor:
        """(..., M) by how much distances (..., M) of a whole shape are off at samples `rows` (M,), clamped.

        Of points without regard to the sign: known ones are on the surface, and around them it is at least
        `low` away. That it is as near as the nearest of them the known ones say, too, and without its noise.
        """
        sdf = self.sdf[rows].expand_as(whole)
        if self.low is None:
            return clamped_error(whole, sdf, losses)
        size = whole.abs()
        return torch.relu(self.low[rows].clamp(max=losses.clamp) - size) + size * (sdf <= 0)

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(M,) signed, of the shape at points (M, 3); raises SettingError where it may not be asked."""
        if self.shape is None:
            raise SettingError("only samples of the shape are known")
        return self.shape.unit_distance(Similarity(1.0, self.turn)(points))

    def turned(self, turn: Quaternion) -> Target:
        """The same shape in the frame that `turn`, a unit quaternion (w, x, y, z), leads to this one."""
        matrix = torch.tensor(rotation_matrix(turn), dtype=self.points.dtype)
        surface = None if self.surface is None else self.surface @ matrix
        whole = quaternion_product(self.turn, turn)
        return replace(self, points=self.points @ matrix, surface=surface, turn=whole)

    def halves(self) -> tuple[Tensor, Tensor]:
        """Rows that lie inside, or on known points, and the others; each draw takes half of either."""
        inside = self.sdf <= 0
        return inside.nonzero().squeeze(1), (~inside).nonzero().squeeze(1)
