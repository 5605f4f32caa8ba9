"""Where a tree is judged: points with their side and what a wrong side costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes import Shape

_NEAR_SIGMAS = (0.02, 0.006)
_INDIFFERENT_DISTANCE = 0.004  # unit lengths: nearer to the surface a side matters less, down to not at all
_DOUBLE_WEIGHT_DEPTH = 0.05  # at this depth a wrong side counts twice what it does near the surface
_OUTER_HALF_SIDE = 1.6  # half side of the cube whose outside samples keep convexes from running off
_TOTAL_WEIGHT = 2.0**20  # sum of all weights: whole numbers whose sums, ten times over, are exact in float32


@dataclass(frozen=True)
class OccupancySamples:
    """Points (N, 3), inside (N,), and weight (N,), whole numbers; the first `near` lie near the surface,
    `uniform` more in the bounding box, the rest around it."""

    points: NDArray[np.float32]
    inside: NDArray[np.bool_]
    weight: NDArray[np.float32]
    near: int
    uniform: int

    @property
    def volume(self) -> float:
        """Weight of all that is inside."""
        return float(self.weight[self.inside].sum(dtype=np.float64))

    def with_points(
        self, points: NDArray[np.float64], inside: NDArray[np.bool_], cost: float
    ) -> OccupancySamples:
        """These and points (N, 3) with their sides (N,), which weigh `cost` together."""
        weight = np.full(len(points), max(1.0, np.rint(cost / len(points))), np.float32)
        return OccupancySamples(
            np.concatenate([self.points, points.astype(np.float32)]),
            np.concatenate([self.inside, inside]),
            np.concatenate([self.weight, weight]),
            self.near,
            self.uniform,
        )


def draw_samples(shape: Shape, near: int, uniform: int, seed: int) -> OccupancySamples:
    """Near-surface and random points with the shape's own side, exact at any scale (the paper's are the
    centres of 64^3 voxels, section 4.2, so that it cannot see what is thinner than one).

    A wrong side costs in proportion to 1 + distance / 0.05: the surface that it misplaces by that distance
    enters the Chamfer distance with the square, the volume counts the rest.
    """
    drawn = shape.samples(near, uniform, seed, _NEAR_SIGMAS)
    rng = np.random.default_rng((seed, 2))
    around = (_OUTER_HALF_SIDE * rng.uniform(-1, 1, (uniform // 4, 3))).astype(np.float32)
    around = around[np.abs(around).max(axis=1) > 0.95]
    points = np.concatenate([drawn.points, around])
    distance = np.concatenate([drawn.distance, shape.unit_distance(around)])
    depth = np.abs(distance)
    weight = np.clip(depth / _INDIFFERENT_DISTANCE, 0.0, 1.0) * (
        1.0 + np.minimum(depth, 10 * _DOUBLE_WEIGHT_DEPTH) / _DOUBLE_WEIGHT_DEPTH
    )
    weight = np.rint(weight * (_TOTAL_WEIGHT / weight.sum())).astype(np.float32)
    return OccupancySamples(points, distance < 0, weight, near, uniform)
