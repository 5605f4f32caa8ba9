"""Intersection over union of two solids on a grid."""

from __future__ import annotations

import numpy as np

from partwright.errors import SettingError
from partwright.meshing import occupancy_grid
from partwright.meshing.blocks import Distance
from partwright.metrics.metric import Metric

RESOLUTION = 128


def iou(distance: Distance, occupancy: np.ndarray) -> float:
    """`iou`: occupancy at the R^3 (128^3) cell centres of [-1, 1]^3 in the unit frame.

    distance: the result's field in the unit frame; occupancy: (R, R, R) bool, the shape's inside.
    """
    return occupancy_iou(occupancy_grid(distance, occupancy.shape[0]), occupancy)


def occupancy_iou(first: np.ndarray, second: np.ndarray) -> float:
    """|A and B| / |A or B| of two bool arrays of one shape; 1 where both are empty.

    Raises SettingError where the shapes differ.
    """
    if first.shape != second.shape:
        raise SettingError(f"Occupancies of shapes {first.shape} and {second.shape} cannot be compared.")
    either = int(np.count_nonzero(first | second))
    return int(np.count_nonzero(first & second)) / either if either else 1.0


IOU = Metric(lambda pair: iou(pair.local.distance, pair.shape.unit_occupancy(RESOLUTION)), "higher")
