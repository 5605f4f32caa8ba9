"""Regions that the symmetries of a shape take to one another: what is fitted to one serves the others.

A search that fits each leg of a table by itself takes as long for each, and gives legs that differ.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partwright.superfrusta.samples import FitSamples, voxel_of

_POINTS = 200  # of a region
_COVERED = 0.7  # share of them whose images lie in another, for it to be its image
_AS_LARGE = 0.6  # of the larger one, at least


def first_alike(samples: FitSamples, regions: Sequence[tuple[NDArray[np.bool_], float]]) -> list[int]:
    """For each region, its voxels (X * Y * Z,) and its sign, the first that it is an image of, else its own
    index."""
    alike: list[int] = []
    sizes = [int(np.count_nonzero(voxels)) for voxels, _ in regions]
    for index, (voxels, sign) in enumerate(regions):
        rivals = [
            other
            for other in range(index)
            if alike[other] == other and regions[other][1] == sign and _as_large(sizes[index], sizes[other])
        ]
        places = _images(samples, voxels) if rivals else []
        same = (other for other in rivals if _covers(regions[other][0], places))
        alike.append(next(same, index))
    return alike


def _as_large(one: int, other: int) -> bool:
    return min(one, other) >= _AS_LARGE * max(one, other)


def _covers(region: NDArray[np.bool_], images: Sequence[NDArray[np.int64]]) -> bool:
    """Whether most of the voxels (n,) of any image are a region's."""
    return any(region[voxels].mean() > _COVERED for voxels in images)


def _images(samples: FitSamples, region: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Voxels (n,) that images of some of a region's lie in, for each isometry."""
    voxels = np.flatnonzero(region)
    points = samples.grid_points[voxels[:: -(-len(voxels) // _POINTS)]]
    return [voxel_of(samples.grid, image(points).astype(np.float32)) for image in samples.images]
