"""Marching cubes on cells whose corner values are known already: plain, with straight interpolation."""

from __future__ import annotations

import numpy as np

from partwright.meshing.marching import _MARGIN, _welded
from partwright.meshing.polygons import Polygons
from partwright.meshing.tables import CORNERS, EDGE_AXIS, EDGES, loop_table


def cell_polygons(cells: np.ndarray, values: np.ndarray) -> Polygons:
    """The zero level in lattice cells (C, 3), integers, whose corners in the order of `tables.CORNERS` have
    the values (C, 8). Vertices are in lattice coordinates; closed where all cells that it enters are given.
    """
    table = loop_table()
    pattern = ((values < 0) << np.arange(8)).sum(axis=1)
    crossed = np.flatnonzero((pattern > 0) & (pattern < 255))
    pattern = pattern[crossed]
    owner = np.repeat(np.arange(len(crossed)), table.count[pattern])
    first = np.cumsum(table.count[pattern]) - table.count[pattern]
    loop = np.arange(len(owner)) - first[owner]
    kind, cell = pattern[owner], crossed[owner]
    length, edge = table.length[kind, loop], table.edges[kind, loop]

    used = np.arange(edge.shape[1]) < length[:, None]
    edge_used, holder = edge[used], np.repeat(cell, length)
    lattice = cells[holder] + CORNERS[EDGES[edge_used, 0]]
    axis = EDGE_AXIS[edge_used]
    index = np.zeros(edge.shape, dtype=np.int64)
    vertices = np.zeros((0, 3))
    if len(lattice):
        chosen, index[used] = _welded(lattice, axis)
        ends = values[holder[chosen][:, None], EDGES[edge_used[chosen]]].astype(np.float64)
        vertices = lattice[chosen].astype(np.float64)
        along = ends[:, 0] / (ends[:, 0] - ends[:, 1])
        vertices[np.arange(len(chosen)), axis[chosen]] += np.clip(along, _MARGIN, 1 - _MARGIN)
    return Polygons(vertices, index, length, table.triangles[kind, loop], cells[cell])
