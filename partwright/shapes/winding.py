"""Winding numbers of a closed mesh on a whole grid at once, by scan conversion.

Every triangle is projected along z onto the grid's columns. A column that it covers gets +1 or -1 at the
height where it crosses, and a running sum down the column is the winding number. The two triangles at an edge
compute the crossing from the same numbers in the same order and cover half-open intervals, so no column is
ever counted twice or missed: on a closed mesh the result is an exact integer, whatever slivers it has.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.shapes.topology import EdgeTable, components

_CHUNK = 4_000_000  # (triangle, column) pairs in memory at once


def winding_grid(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    origin: ArrayLike,
    spacing: float,
    shape: tuple[int, int, int],
) -> NDArray[np.int32]:
    """Winding number of a closed mesh at the points origin + spacing * (i, j, k): (nx, ny, nz) int32.

    Vertices (V, 3), faces (F, 3). On a mesh with open edges the numbers are meaningless.
    """
    nx, ny, nz = shape
    grid = (vertices - np.asarray(origin)) / spacing
    # Difference array along z with one extra layer: a crossing at index k counts for every point below it.
    steps = np.zeros(nx * ny * (nz + 1), dtype=np.int32)
    for column, height, sign in _crossings(grid, faces, nx, ny):
        layer = np.clip(np.ceil(height), 0, nz).astype(np.int64)
        np.add.at(steps, column * (nz + 1) + layer, sign)
    below = steps.reshape(nx, ny, nz + 1)[:, :, ::-1].cumsum(axis=2, dtype=np.int32)[:, :, ::-1]
    return below[:, :, 1:]


def closing_fans(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Triangles (B, 3) that close a surface, and its vertices with the fans' middles added.

    Each connected set of open edges gets a fan around its middle. A boundary has no boundary, so whatever the
    edges look like, surface and fans together are closed.
    """
    rim = EdgeTable(faces).unbalanced_half_edges
    if len(rim) == 0:
        return vertices, np.zeros((0, 3), dtype=np.int64)
    used, ends = np.unique(rim, return_inverse=True)
    ends = ends.reshape(-1, 2)
    loop = components(len(used), ends[:, 0], ends[:, 1])
    size = np.bincount(loop)
    middle = np.stack([np.bincount(loop, vertices[used, k]) / size for k in range(3)], axis=1)
    apex = len(vertices) + loop[ends[:, 0]]
    return np.concatenate([vertices, middle]), np.stack([rim[:, 1], rim[:, 0], apex], axis=1)


def _crossings(
    grid: NDArray[np.float64], faces: NDArray[np.int64], nx: int, ny: int
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int32]]]:
    """(column, height, sign) of every triangle's crossing with every column, in bounded chunks."""
    low, mid, high, parity = _sorted_by_row(grid, faces)
    first = np.clip(np.ceil(grid[low, 1]), 0, ny).astype(np.int64)
    stop = np.clip(np.ceil(grid[high, 1]), 0, ny).astype(np.int64)
    triangle, row = _expand(first, stop)
    upper_half = row >= grid[mid[triangle], 1]
    x_long, z_long = _at_row(grid, low[triangle], high[triangle], row)
    x_short, z_short = _at_row(
        grid,
        np.where(upper_half, mid[triangle], low[triangle]),
        np.where(upper_half, high[triangle], mid[triangle]),
        row,
    )
    at_long = np.clip(np.ceil(x_long), 0, nx).astype(np.int64)
    at_short = np.clip(np.ceil(x_short), 0, nx).astype(np.int64)
    sign = np.where(at_long < at_short, parity[triangle], -parity[triangle])
    begin, end = np.minimum(at_long, at_short), np.maximum(at_long, at_short)
    covered = end > begin
    begin, end, row, sign = begin[covered], end[covered], row[covered], sign[covered]
    x_long, z_long = x_long[covered], z_long[covered]
    x_span, z_span = x_short[covered] - x_long, z_short[covered] - z_long
    ends = np.cumsum(end - begin)
    start = 0
    while start < len(begin):
        base = ends[start - 1] if start else 0
        until = max(start + 1, int(np.searchsorted(ends, base + _CHUNK, side="right")))
        span, x = _expand(begin[start:until], end[start:until])
        span += start
        fraction = np.clip((x - x_long[span]) / x_span[span], 0.0, 1.0)
        yield x * ny + row[span], z_long[span] + fraction * z_span[span], sign[span]
        start = until


def _sorted_by_row(
    grid: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int32]]:
    """Each triangle's vertices by rising y (ties by index), and +1 or -1 for which way round they then go."""
    y = grid[faces, 1]
    a, b, c = faces[:, 0], faces[:, 1], faces[:, 2]
    b_after_a = (y[:, 1] > y[:, 0]) | ((y[:, 1] == y[:, 0]) & (b > a))
    c_after_a = (y[:, 2] > y[:, 0]) | ((y[:, 2] == y[:, 0]) & (c > a))
    c_after_b = (y[:, 2] > y[:, 1]) | ((y[:, 2] == y[:, 1]) & (c > b))
    rank_a = 2 - b_after_a.astype(np.int64) - c_after_a
    rank_b = b_after_a + (1 - c_after_b.astype(np.int64))
    rank = np.stack([rank_a, rank_b, 3 - rank_a - rank_b], axis=1)
    ordered = np.take_along_axis(faces, np.argsort(rank, axis=1), axis=1)
    # (low, mid, high) is an even permutation of (a, b, c) exactly when rank_b follows rank_a cyclically.
    even = (rank_b - rank_a) % 3 == 1
    # A triangle that runs low-mid-high counterclockwise, so faces up, has its long edge on the left.
    return ordered[:, 0], ordered[:, 1], ordered[:, 2], np.where(even, 1, -1).astype(np.int32)


def _at_row(
    grid: NDArray[np.float64], start: NDArray[np.int64], end: NDArray[np.int64], row: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x and z where the edge start-end passes the row."""
    p, q = grid[start], grid[end]
    fraction = (row - p[:, 1]) / (q[:, 1] - p[:, 1])
    return p[:, 0] + fraction * (q[:, 0] - p[:, 0]), p[:, 2] + fraction * (q[:, 2] - p[:, 2])


def _expand(start: NDArray[np.int64], stop: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Every integer of every [start, stop): (which interval, the integer)."""
    count = np.maximum(stop - start, 0)
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(start, count)
