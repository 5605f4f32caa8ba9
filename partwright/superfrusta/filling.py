"""Samples of a shape some of whose empty voxels count as full."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.superfrusta.samples import FitSamples, voxel_of

_LEAST = 1e-4  # unit lengths: as near as the voxels let a sample be
_BESIDE = 2.3  # voxels from the filling: the shape's surface there is none any more


def filled(samples: FitSamples, filling: NDArray[np.bool_]) -> FitSamples:
    """Samples of the shape and of a filling (X, Y, Z) of its grid.

    Distances are to the voxel where the filling is what is near, and the shape's own elsewhere.
    """
    values, spacing = samples.grid.values, samples.grid.spacing
    solid = (values < 0) | filling
    to_filling, full = ndimage.distance_transform_edt(~filling, return_indices=True)
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
        within[unsure] = off(full, voxel[unsure], at) < off(empty, voxel[unsure], at)
        beyond = np.linalg.norm(points - samples.grid_points[voxel], axis=1)  # the grid
        rough = spacing * (0.5 * np.sign(depth[voxel]) - depth[voxel]) + np.maximum(beyond - spacing, 0)
        rough = np.where(within, np.minimum(rough, -_LEAST), np.maximum(rough, _LEAST))
        return np.where(near_filling[voxel] < np.abs(own) + 2 * spacing, rough, own).astype(np.float32)

    def measure(points: NDArray[np.float32]) -> NDArray[np.float32]:
        return distance(samples.measure(points), voxel_of(samples.grid, points), points)

    def open_(points: NDArray[np.float32]) -> NDArray[np.bool_]:
        return to_filling.ravel()[voxel_of(samples.grid, points)] > _BESIDE

    voxels = np.arange(values.size)
    return replace(
        samples,
        distance=distance(samples.distance, samples.voxel, samples.points),
        grid=replace(
            samples.grid, values=distance(values.ravel(), voxels, samples.grid_points).reshape(values.shape)
        ),
        measure=measure,
        away=lambda points, within=np.inf: np.abs(measure(points)),
        probes=samples.probes[open_(samples.probes)],
        surface=samples.surface[open_(samples.surface)],
    )
