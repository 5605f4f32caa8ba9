"""A shape with its hollows filled: what a body looks like before it is hollowed out.

A pot, a pipe or a housing is a plain body less a plain body. Growth cannot see that: it builds walls, piece
by piece. So where a shape has hollows, the body is grown first as if they were full, and carved afterwards.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.superfrusta.samples import FitSamples

_WORTH = 0.1  # of the shape's volume that its hollows must have
_LEAST = 1e-4  # unit lengths: as near as the voxels let a sample be


def hollows(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Empty voxels (X, Y, Z) that the shape goes all around in a layer along one of the axes: closed holes,
    bores, and vessels that stand upright or lie."""
    found = np.zeros_like(occupied)
    for axis in range(3):
        layer = ndimage.generate_binary_structure(3, 1)
        layer[(slice(None),) * axis + ([0, 2],)] = False  # neighbours within the layer alone
        labels, count = ndimage.label(~occupied, layer)
        open_ = np.zeros(count + 1, bool)
        for other in {0, 1, 2} - {axis}:
            for side in (0, -1):
                open_[np.take(labels, side, axis=other)] = True
        open_[0] = True  # the shape itself
        found |= ~open_[labels]
    return found


def with_hollows_filled(samples: FitSamples) -> FitSamples | None:
    """Samples of the shape with its hollows filled; None where they are small.

    Distances are to the voxel where the filling is what is near, and the shape's own elsewhere.
    """
    values, spacing = samples.grid.values, samples.grid.spacing
    occupied = values < 0
    filling = hollows(occupied)
    if np.count_nonzero(filling) < _WORTH * np.count_nonzero(occupied):
        return None
    solid = occupied | filling
    to_filling, filled = ndimage.distance_transform_edt(~filling, return_indices=True)
    to_empty, empty = ndimage.distance_transform_edt(solid, return_indices=True)
    depth = (to_empty - ndimage.distance_transform_edt(~solid)).ravel()
    near_filling, solid = spacing * to_filling.ravel(), solid.ravel()

    def off(
        nearest: NDArray[np.int64], voxel: NDArray[np.int64], at: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """From places in voxels (n, 3) to the nearest voxel of a kind."""
        return np.asarray(np.linalg.norm(nearest.reshape(3, -1)[:, voxel].T - at, axis=1))

    def distance(
        own: NDArray[np.float32], voxel: NDArray[np.int64], points: NDArray[Any]
    ) -> NDArray[np.float32]:
        within = (own < 0) | filling.ravel()[voxel]
        # Beside a wall, what is empty may lie in a voxel of the wall: then on the side that it is nearer to.
        unsure = np.flatnonzero(~within & solid[voxel])
        at = (points[unsure] - samples.grid.origin) / spacing
        within[unsure] = off(filled, voxel[unsure], at) < off(empty, voxel[unsure], at)
        beyond = np.linalg.norm(points - samples.grid_points[voxel], axis=1)  # the grid
        rough = spacing * (0.5 * np.sign(depth[voxel]) - depth[voxel]) + np.maximum(beyond - spacing, 0)
        rough = np.where(within, np.minimum(rough, -_LEAST), np.maximum(rough, _LEAST))
        return np.where(near_filling[voxel] < np.abs(own) + 2 * spacing, rough, own).astype(np.float32)

    voxels = np.arange(values.size)
    return replace(
        samples,
        distance=distance(samples.distance, samples.voxel, samples.points),
        grid=replace(
            samples.grid, values=distance(values.ravel(), voxels, samples.grid_points).reshape(values.shape)
        ),
    )
