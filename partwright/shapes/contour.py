"""The zero level of values on a grid as a closed triangle mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Corners of a cell in the order in which libigl counts them.
_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=np.int64
)
_LEAST = 1e-3  # of the typical value beside the surface: keeps vertices off the grid points, so none coincide


def contour(
    values: NDArray[np.floating], origin: ArrayLike, spacing: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and faces (F, 3) where values (nx, ny, nz), negative inside, pass zero.

    `values[i, j, k]` belongs to origin + spacing * (i, j, k). The mesh faces outwards and is closed when no
    value at the border of the grid is negative. Both are empty when no value is negative, or all are.
    """
    import igl

    inside = values < 0
    crossed = np.argwhere(crossed_cells(inside))
    if len(crossed) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    corner = np.ravel_multi_index(tuple(np.moveaxis(crossed[:, None] + _CORNERS, -1, 0)), values.shape)
    used, cells = np.unique(corner, return_inverse=True)
    places = np.stack(np.unravel_index(used, values.shape), axis=1).astype(np.float64)
    value = values.ravel()[used].astype(np.float64)
    least = _LEAST * float(np.median(np.abs(value)))
    value = np.where(inside.ravel()[used], np.minimum(value, -least), np.maximum(value, least))
    vertices, faces, _ = igl.marching_cubes(value, places, cells.reshape(-1, 8).astype(np.int64), 0.0)
    return np.asarray(origin) + np.asarray(spacing) * vertices, np.asarray(faces, dtype=np.int64)


def crossed_cells(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which cells (nx - 1, ny - 1, nz - 1) have corners of both kinds."""
    every, some = inside, inside
    for axis in range(3):
        low = tuple(slice(None, -1) if k == axis else slice(None) for k in range(3))
        high = tuple(slice(1, None) if k == axis else slice(None) for k in range(3))
        every, some = every[low] & every[high], some[low] | some[high]
    return some & ~every
