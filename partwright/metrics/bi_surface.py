"""Agreement of two solids near both surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.blocks import Distance
from partwright.metrics.iou import occupancy_iou
from partwright.metrics.metric import Metric

if TYPE_CHECKING:
    from partwright.metrics.comparison import Comparison

COUNT = 20_000
SIGMA = 0.02


def bi_surface_iou(
    first: Distance, second: Distance, on_first: np.ndarray, on_second: np.ndarray, seed: int = 0
) -> float:
    """`bi_surface_iou`: mean of two occupancy IoUs, at 20,000 area-weighted points of each surface moved by
    isotropic 3D Gaussian noise of sigma 0.02, unit frame.

    first, second: the two fields; on_first, on_second: (N, 3) points of their surfaces, unit frame.
    """
    # Not the stream of that seed itself: the points may have been drawn from it.
    rng = np.random.default_rng((seed, 1))
    scores = []
    for surface in (on_first, on_second):
        points = (surface + rng.normal(0.0, SIGMA, surface.shape)).astype(np.float32)
        scores.append(occupancy_iou(first(points) < 0, second(points) < 0))
    return float(np.mean(scores))


def _measured(pair: Comparison) -> float:
    on_result, on_shape = pair.on_result(COUNT, 3), pair.on_shape(COUNT, 3)
    distances = pair.local.distance, pair.shape.unit_distance
    return bi_surface_iou(*distances, on_result, on_shape, pair.streams[4])


BI_SURFACE_IOU = Metric(_measured, "higher")
