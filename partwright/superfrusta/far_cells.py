"""Cells about a shape, coarser than its voxels, in which parts that reach far out are followed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.grid import grid_indices

HALF_SIDE = 1.2  # unit lengths: half the side of the cube about the shape, beyond which all is far from it
ALONG = 48  # cells along a side of that cube
CELL = 2 * HALF_SIDE / ALONG  # unit lengths
FURTHEST = 2.4  # unit lengths from the middle: how far parts are followed
_REACH = round(FURTHEST / CELL)  # cells from the middle, as far


def cell_of(points: NDArray[np.floating]) -> NDArray[np.int64]:
    """The cell that each point lies in, as whole numbers from the middle, none further than parts are
    followed."""
    most = FURTHEST - CELL / 2
    return np.floor(np.clip(points, -most, most) / CELL).astype(np.int64)


def cell_middles() -> NDArray[np.float32]:
    """(ALONG ** 3, 3) of the cells of the cube."""
    return (CELL * (grid_indices((ALONG,) * 3) + 0.5) - HALF_SIDE).astype(np.float32)


def beyond_too(far: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether cells as far out as parts are followed are far from the shape, of those of the cube
    (ALONG ** 3,)."""
    return np.pad(far.reshape((ALONG,) * 3), _REACH - ALONG // 2, constant_values=True)


def middles_within(
    wanted: NDArray[np.bool_], low: NDArray[np.floating], high: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Middles (n, 3) of the cells that are wanted, of those of `beyond_too`, and lie in any of the boxes
    between corners (M, 3)."""
    first, end = cell_of(low) + _REACH, cell_of(high) + _REACH + 1
    start = first.min(axis=0)
    within = np.zeros(end.max(axis=0) - start, bool)
    for box in zip(first - start, end - start, strict=True):
        within[_slices(*box)] = True
    within &= wanted[_slices(start, start + within.shape)]
    return (CELL * (start - _REACH + np.argwhere(within) + 0.5)).astype(np.float32)


def _slices(first: NDArray[np.int64], end: NDArray[np.int64]) -> tuple[slice, ...]:
    """Of an array, from one cell (3,) to before another."""
    return tuple(slice(*pair) for pair in zip(first, end, strict=True))
