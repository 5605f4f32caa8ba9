"""A body to carve from: the solid that fits a shape's convex hull, holes and pockets and all.

Growth adds whatever explains the most at once, and so builds walls around a pocket: a block minus a block is
not on its way. It is when the block is there first and only has to lose what it has too much.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.samples import NOTHING, FitSamples, Rows
from partwright.superfrusta.settings import Settings

_HULL_VOXELS = 4000  # voxels that the hull is made of
_MARGIN = 0.2  # share of the longest side within which samples around the hull count


def convex_hull_start(samples: FitSamples, settings: Settings) -> Rows:
    """The part (1, 17) that fits the shape's convex hull best; none where the shape is flat."""
    inside = samples.grid.values.ravel() < 0
    points = samples.grid_points[inside]
    try:
        hull = ConvexHull(points[:: max(1, len(points) // _HULL_VOXELS)])
    except QhullError:
        return NOTHING
    depth = float(-samples.grid.values.min())
    region = Region(inside, NOTHING, depth, _MARGIN, 1.0, hull=np.asarray(hull.equations, np.float32))
    return fit_regions(samples, [region], settings)
