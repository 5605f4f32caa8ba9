"""The inside of a field on a grid, evaluated only near the surface."""

from __future__ import annotations

import numpy as np

from partwright.fields.base import LIPSCHITZ
from partwright.meshing.blocks import BLOCK, Distance, Grid, evaluate, subdivided

_CELLS = np.stack(np.meshgrid(*[np.arange(BLOCK)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
_LEVELS = (16, 8, BLOCK)


def occupancy_grid(distance: Distance, resolution: int = 128, lipschitz: float = LIPSCHITZ) -> np.ndarray:
    """(R, R, R) bool: which of the R^3 cell centres of [-1, 1]^3 are inside, index order x, y, z.

    Blocks whose centre is farther from zero than lipschitz times their half diagonal are filled at once, the
    others halved from 16 cells down to 4, of which each cell is evaluated.
    """
    grid = Grid(np.full(3, -1.0), np.full(3, 2.0 / resolution), np.full(3, resolution))
    padded = -(-resolution // _LEVELS[0]) * _LEVELS[0]
    inside = np.zeros((padded,) * 3, dtype=bool)
    count = padded // _LEVELS[0]
    blocks = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    for size in _LEVELS:
        values = evaluate(distance, grid.points((blocks + 0.5) * size))
        far = np.abs(values) > lipschitz * size * float(np.linalg.norm(grid.cell)) / 2
        _view(inside, size)[tuple(blocks[far & (values < 0)].T)] = True
        blocks = blocks[~far]
        if size > BLOCK:
            blocks = subdivided(blocks)
    cells = blocks[:, None] * BLOCK + _CELLS
    values = evaluate(distance, grid.points(cells + 0.5))
    _view(inside, BLOCK)[tuple(blocks.T)] = (values < 0).reshape(-1, BLOCK, BLOCK, BLOCK)
    return inside[:resolution, :resolution, :resolution]


def _view(grid: np.ndarray, size: int) -> np.ndarray:
    """The grid as blocks: view[i, j, k] is the block's (size, size, size) cells."""
    count = grid.shape[0] // size
    return grid.reshape(count, size, count, size, count, size).transpose(0, 2, 4, 1, 3, 5)
