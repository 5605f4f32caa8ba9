"""Where a field's zero level is: blocks of 4^3 cells, found from coarse to fine and grown until closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from partwright.errors import NoSurfaceError, NotFiniteError
from partwright.fields.base import LIPSCHITZ

Distance = Callable[[np.ndarray], np.ndarray]

BLOCK = 4  # cells along a block
COARSEST = 16  # cells along a block of the first level

_CHILDREN = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True)
class Grid:
    """A lattice of cells: corner (i, j, k) lies at origin + cell * (i, j, k)."""

    origin: np.ndarray
    cell: np.ndarray
    cells: np.ndarray

    @classmethod
    def around(cls, lower: np.ndarray, upper: np.ndarray, cell: np.ndarray) -> Grid:
        """Cells over a box. The lattice is set off by a part of a cell, since faces of a shape that is
        centred on the origin would otherwise fall exactly onto corners."""
        shift = np.array([0.31, 0.37, 0.43])
        cells = np.ceil((upper - lower) / cell + shift + 0.2).astype(np.int64)
        return cls(lower - shift * cell, cell, np.maximum(cells, 1))

    def points(self, corners: np.ndarray) -> np.ndarray:
        """Places of lattice corners (..., 3) as (N, 3) float32."""
        rows = corners.reshape(-1, 3)
        points = np.empty(rows.shape, np.float32)
        for i in range(3):  # by columns: rows of three are slow to loop over
            points[:, i] = self.origin[i] + rows[:, i] * self.cell[i]
        return points


def evaluate(distance: Distance, points: np.ndarray) -> np.ndarray:
    """Call the field and refuse values that are not finite."""
    values = np.asarray(distance(np.ascontiguousarray(points, dtype=np.float32)), dtype=np.float32)
    if not np.isfinite(values).all():
        raise NotFiniteError(
            f"The field is not finite at {int((~np.isfinite(values)).sum())} of {len(values)} points; "
            "check the parameters of its parts."
        )
    return values


def active_blocks(distance: Distance, grid: Grid, lipschitz: float = LIPSCHITZ) -> np.ndarray:
    """Blocks (K, 3) of BLOCK^3 cells that the zero level may enter, as integer block coordinates.

    A block whose centre is farther from zero than lipschitz times its half diagonal is left out. The others
    are halved until they are BLOCK cells long.
    """
    size = COARSEST
    counts = -(-grid.cells // size)
    blocks = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3)
    while True:
        reach = lipschitz * size * float(np.linalg.norm(grid.cell)) / 2
        values = evaluate(distance, grid.points((blocks + 0.5) * size))
        blocks = blocks[np.abs(values) <= reach]
        if size == BLOCK:
            return blocks
        size //= 2
        blocks = subdivided(blocks)


def subdivided(blocks: np.ndarray) -> np.ndarray:
    """The eight halves (8 K, 3) of each block (K, 3), in coordinates of half the size."""
    return (2 * blocks[:, None] + _CHILDREN).reshape(-1, 3)


def block_values(distance: Distance, grid: Grid, blocks: np.ndarray) -> np.ndarray:
    """Values (K, B + 1, B + 1, B + 1) at the corners of each block's cells."""
    lattice = blocks[:, :, None] * BLOCK + np.arange(BLOCK + 1)
    along = (grid.origin[:, None] + lattice * grid.cell[:, None]).astype(np.float32)  # (K, 3, B + 1)
    points = np.empty((len(blocks), *[BLOCK + 1] * 3, 3), np.float32)
    points[..., 0] = along[:, 0, :, None, None]
    points[..., 1] = along[:, 1, None, :, None]
    points[..., 2] = along[:, 2, None, None, :]
    return evaluate(distance, points.reshape(-1, 3)).reshape(points.shape[:-1])


def block_keys(blocks: np.ndarray) -> np.ndarray:
    """One int64 a block; coordinates may run from -2^19 to 2^19."""
    x, y, z = (blocks + (1 << 19)).T.astype(np.int64)
    return (x << 40) | (y << 20) | z


def surface_blocks(
    distance: Distance, grid: Grid, lipschitz: float = LIPSCHITZ
) -> tuple[np.ndarray, np.ndarray]:
    """All blocks that the zero level enters, with their corner values: (K, 3), (K, B + 1, B + 1, B + 1).

    Wherever the sign changes on a block's face, the neighbour is added too. So no surface is cut open,
    whether the bound on the field's slope was too low or the surface leaves the box.

    Raises NoSurfaceError where the field has one sign everywhere, or the surface runs on past twice the box.
    """
    blocks = active_blocks(distance, grid, lipschitz)
    values = block_values(distance, grid, blocks)
    newest, newest_values = blocks, values
    limit = grid.cells // BLOCK + 2
    unit = np.eye(3, dtype=np.int64)
    while len(newest):
        neighbours = np.concatenate(
            [
                newest[_changes(newest_values.take(side, axis=1 + axis))] + step * unit[axis]
                for axis in range(3)
                for side, step in ((0, -1), (BLOCK, 1))
            ]
        )
        newest = neighbours[~np.isin(block_keys(neighbours), block_keys(blocks))]
        newest = newest[np.unique(block_keys(newest), return_index=True)[1]]
        if ((newest < -limit) | (newest > 2 * limit)).any():
            raise NoSurfaceError(
                "The field's surface does not close within twice the given box; "
                "give the bounds of a closed surface."
            )
        newest_values = block_values(distance, grid, newest)
        blocks = np.concatenate([blocks, newest])
        values = np.concatenate([values, newest_values])
    entered = _changes(values)
    if not entered.any():
        raise NoSurfaceError(
            "The field has no zero level in the box (or it is thinner than a cell): "
            "give other bounds or a higher resolution."
        )
    return blocks[entered], values[entered]


def _changes(values: np.ndarray) -> np.ndarray:
    """Whether the sign changes within values[i]."""
    rest = tuple(range(1, values.ndim))
    inside = values < 0
    return np.asarray(inside.any(axis=rest) & ~inside.all(axis=rest))
