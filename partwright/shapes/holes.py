"""Holes in a surface: a fan of triangles over each opening that is one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.cleaning import counted
from partwright.shapes.distance import MeshDistance
from partwright.shapes.topology import EdgeTable, boundary_loops

_HALF = 0.3  # a lid over a true opening sees a winding number within 0.5 +- this on both of its sides
_STEP = 1e-4


def fill_holes(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Close every opening that a fan from the middle of its rim closes.

    The rim of a loose patch that other patches already cover is no opening: there the winding number is near
    0 or 1, not near one half, and the patch stays as it is.
    """
    faces = edges.faces
    loops = boundary_loops(edges.open_half_edges)
    if not loops:
        return vertices, edges
    source = MeshDistance(vertices, faces, faces, closed=False)
    lids: list[NDArray[np.int64]] = []
    middles: list[NDArray[np.float64]] = []
    for loop in loops:
        middle = vertices[loop].mean(axis=0)
        rim = vertices[loop]
        if _is_opening(source, rim, middle):
            # Half-edges of the surface run along the rim, so the lid's run against it.
            number = np.full(len(loop), len(vertices) + len(middles))
            lids.append(np.stack([np.roll(loop, -1), loop, number], axis=1))
            middles.append(middle)
    if not lids:
        return vertices, edges
    lid = np.concatenate(lids)
    filled = np.concatenate([vertices, middles]), np.concatenate([faces, lid])
    share = _area(filled[0], lid) / _area(*filled)
    notes.append(f"filled {counted(len(lids), 'hole')} ({share:.1%} of the surface)")
    return filled[0], EdgeTable(filled[1])


def _is_opening(source: MeshDistance, rim: NDArray[np.float64], middle: NDArray[np.float64]) -> bool:
    ahead = np.roll(rim, -1, axis=0)
    normal = np.cross(rim - middle, ahead - middle).sum(axis=0)
    normal /= max(float(np.linalg.norm(normal)), np.finfo(np.float64).tiny)
    place = (rim + ahead + middle) / 3
    winding = source.winding(np.concatenate([place - _STEP * normal, place + _STEP * normal]))
    return bool(np.median(np.abs(winding - 0.5)) < _HALF)


def _area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    corners = vertices[faces]
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
        / 2
    )
