"""Sparse marching cubes: the zero level of a field as a closed triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from partwright.errors import SettingError
from partwright.fields.base import LIPSCHITZ
from partwright.meshing.blocks import BLOCK, Distance, Grid, evaluate, surface_blocks
from partwright.meshing.features import sharpen
from partwright.meshing.polygons import Polygons
from partwright.meshing.refinement import refined
from partwright.meshing.tables import CORNERS, EDGE_AXIS, EDGES, loop_table
from partwright.rows import corners

if TYPE_CHECKING:
    import trimesh

Vector: TypeAlias = Sequence[float] | np.ndarray

# Vertices keep this part of an edge from its ends, so that no two of them ever coincide.
_MARGIN = 0.004
_STEPS = 10
_TOLERANCE = 2e-3  # of a cell


def mesh_field(
    distance: Distance,
    lower: Vector,
    upper: Vector,
    resolution: int | Vector = 128,
    *,
    lipschitz: float = LIPSCHITZ,
    sharp: bool = True,
) -> trimesh.Trimesh:
    """The zero level of a field as a closed mesh with outward normals.

    Only cells near the surface are evaluated (see `blocks`), and every vertex is moved along its edge onto
    the zero level by regula falsi, so its error is far below a cell. With `sharp`, edges and corners of the
    surface are kept where the normals around a cell disagree (Kobbelt et al. 2001, Extended Marching Cubes),
    and triangles across fillets are halved until they follow them (see `refinement`).
    The mesh is a closed two-manifold for every field: see `tables`.

    distance: maps points (N, 3) float32 to values (N,), negative inside; best in a frame around the origin.
    lower, upper: (3,) the box that holds the surface; a surface that leaves it is followed, not cut.
    resolution: cells along the box's longest side, or along each side (cells need not be cubes).
    lipschitz: an upper bound of the field's slope; a piece whose field is steeper may be missed.

    Raises SettingError for a box or resolution that cannot be used, NoSurfaceError where there is no surface
    or one without end, NotFiniteError where the field is.
    """
    import trimesh

    low, high = _box(lower, upper)
    grid = Grid.around(low, high, _cell(low, high, resolution))
    polygons = marching_polygons(distance, grid, lipschitz)
    if sharp:
        vertices, faces = refined(*sharpen(polygons, distance, grid), distance, grid)
    else:
        vertices, faces = polygons.vertices, polygons.triangles()
    return trimesh.Trimesh(vertices, faces, process=False)


def _box(lower: Vector, upper: Vector) -> tuple[np.ndarray, np.ndarray]:
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    shaped = low.shape == high.shape == (3,) and bool(np.isfinite([low, high]).all())
    if not shaped or not (high > low).all():
        raise SettingError(f"The box from {low} to {high} has no volume; give lower < upper along each axis.")
    return low, high


def _cell(low: np.ndarray, high: np.ndarray, resolution: int | Vector) -> np.ndarray:
    counts = np.asarray(resolution, dtype=np.float64)
    if counts.shape not in ((), (3,)) or not (counts >= 1).all() or not (counts <= 4096).all():
        raise SettingError(f"The resolution {resolution} is not one or three numbers from 1 to 4096.")
    extent = high - low
    return extent / counts if counts.ndim else np.full(3, extent.max() / float(counts))


def marching_polygons(distance: Distance, grid: Grid, lipschitz: float = LIPSCHITZ) -> Polygons:
    """The polygons in which the zero level meets the cells, their corners moved onto it."""
    table = loop_table()
    blocks, values = surface_blocks(distance, grid, lipschitz)
    block, place, pattern = _crossed_cells(values)

    # One polygon a loop, in the order of the cells.
    cell = np.repeat(np.arange(len(block)), table.count[pattern])
    first = np.cumsum(table.count[pattern]) - table.count[pattern]
    loop = np.arange(len(cell)) - first[cell]
    kind = pattern[cell]
    length, edge = table.length[kind, loop], table.edges[kind, loop]

    # Corners of polygons, shared between the cells around a lattice edge.
    used = np.arange(edge.shape[1]) < length[:, None]
    owner, edge_used = np.repeat(cell, length), edge[used]
    start = place[owner] + CORNERS[EDGES[edge_used, 0]]
    lattice = blocks[block[owner]] * BLOCK + start
    axis = EDGE_AXIS[edge_used]
    representative, number = _welded(lattice, axis)
    index = np.zeros(edge.shape, dtype=np.int64)
    index[used] = number

    low, axis = start[representative], axis[representative]
    high = low + np.eye(3, dtype=np.int64)[axis]
    owner = block[owner[representative]]
    vertices = _on_zero_level(
        distance,
        grid,
        lattice[representative],
        axis,
        values[owner, low[:, 0], low[:, 1], low[:, 2]],
        values[owner, high[:, 0], high[:, 1], high[:, 2]],
    )
    corner = blocks[block] * BLOCK + place
    return Polygons(vertices, index, length, table.triangles[kind, loop], corner[cell])


def _crossed_cells(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells in which the sign changes: their block (K,), place in the block (K, 3), sign pattern (K,)."""
    inside = (values < 0).astype(np.uint8)
    patterns = np.zeros((len(values), BLOCK, BLOCK, BLOCK), dtype=np.uint8)
    for corner, (i, j, k) in enumerate(CORNERS.tolist()):
        patterns |= inside[:, i : i + BLOCK, j : j + BLOCK, k : k + BLOCK] << np.uint8(corner)
    found = np.argwhere((patterns > 0) & (patterns < 255))
    return found[:, 0], found[:, 1:], patterns[tuple(found.T)]


def _welded(lattice: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lattice edges (N,), given by their lower corner and axis, welded: one of each (V,), numbers (N,)."""
    low, high = corners(lattice)
    x, y, z = (lattice - low).T
    _, ny, nz = high - low + 1
    key = ((x * ny + y) * nz + z) * 3 + axis
    # As np.unique has them, whose stable sort takes four times as long.
    order = np.argsort(key)
    ordered = key[order]
    begins = np.concatenate([np.ones(min(len(key), 1), bool), ordered[1:] != ordered[:-1]])
    number = np.empty(len(key), np.int64)
    number[order] = np.cumsum(begins) - 1
    return np.minimum.reduceat(order, np.flatnonzero(begins)), number


def _on_zero_level(
    distance: Distance, grid: Grid, lattice: np.ndarray, axis: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """The zero on each lattice edge by regula falsi, in its Illinois variant where the field has a kink.

    Most edges are done after one step; only the others are evaluated again.
    """
    base = grid.origin + lattice * grid.cell
    direction = np.eye(3)[axis] * grid.cell
    enough = _TOLERANCE * grid.cell[axis]
    t_low, t_high = np.zeros(len(axis)), np.ones(len(axis))
    at_low, at_high = low.astype(np.float64), high.astype(np.float64)
    zero = at_low / (at_low - at_high)
    open_edges = np.arange(len(axis))
    for _ in range(_STEPS):
        e, t = open_edges, zero[open_edges]
        value = evaluate(distance, base[e] + t[:, None] * direction[e])
        beyond = (value < 0) != (at_low[e] < 0)
        # Where the line was a poor guess, the end that stays loses half its weight.
        replaced = np.where(beyond, at_high[e], at_low[e])
        weight = np.where(np.abs(value) > 0.02 * np.abs(replaced), 0.5, 1.0)
        t_low[e], t_high[e] = np.where(beyond, t_low[e], t), np.where(beyond, t, t_high[e])
        at_low[e] = np.where(beyond, at_low[e] * weight, value)
        at_high[e] = np.where(beyond, value, at_high[e] * weight)
        zero[e] = t_low[e] + (t_high[e] - t_low[e]) * at_low[e] / (at_low[e] - at_high[e])
        open_edges = e[np.abs(value) > enough[e]]
        if not len(open_edges):
            break
    return base + np.clip(zero, _MARGIN, 1 - _MARGIN)[:, None] * direction
