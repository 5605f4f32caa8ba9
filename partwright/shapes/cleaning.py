"""Doubled vertices, doubled triangles and cracks: the repairs that need no idea of inside and outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.topology import EdgeTable, compacted, components

_WELD = 1e-5  # unit frame; only vertices on open edges are welded, so thin walls cannot collapse


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """'1 hole', '3 holes'."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def merge_vertices(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Join vertices (V, 3) at exactly the same place and drop those that no triangle uses."""
    used, faces = compacted(faces, len(vertices))
    vertices = vertices[used]
    order = np.lexsort(vertices.T)
    moved = np.r_[True, (np.diff(vertices[order], axis=0) != 0).any(axis=1)]
    if moved.all():
        return vertices, faces
    notes.append(f"merged {counted(int(np.count_nonzero(~moved)), 'duplicate vertex', 'duplicate vertices')}")
    target = np.empty(len(vertices), dtype=np.int64)
    target[order] = np.cumsum(moved) - 1
    return vertices[order[moved]], target[faces]


def drop_doubles(faces: NDArray[np.int64], notes: list[str], keep_sheets: bool = False) -> NDArray[np.int64]:
    """Drop triangles with a repeated corner and triangles that are there more than once.

    Of copies that face the same way one stays. Copies that face opposite ways are the two sides of a sheet:
    they enclose nothing and go together, unless nearly the whole mesh is drawn two-sided, when one side
    stays; with `keep_sheets` one side stays of those, too, that no other triangle touches.
    """
    sound = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    if not sound.all():
        notes.append(f"dropped {counted(int(np.count_nonzero(~sound)), 'triangle')} without area")
        faces = faces[sound]
    if len(faces) == 0:
        return faces
    corner = np.sort(faces, axis=1)
    order = np.lexsort(corner.T)
    start = np.flatnonzero(np.r_[True, (np.diff(corner[order], axis=0) != 0).any(axis=1)])
    if len(start) == len(faces):
        return faces
    first = np.argmin(faces, axis=1)
    facing = np.where(
        np.take_along_axis(faces, ((first + 1) % 3)[:, None], axis=1)[:, 0] == corner[:, 1], 1, -1
    )[order]
    group = np.repeat(np.arange(len(start)), np.diff(np.r_[start, len(faces)]))
    net = np.bincount(group, facing, len(start))
    mixed = np.bincount(group, minlength=len(start)) > np.abs(net)
    two_sided = float(mixed.mean()) > 0.9
    stays = np.full(len(start), two_sided)
    if keep_sheets:
        stays |= _apart(corner[order[start]], net == 0)
    wanted = np.where(net == 0, stays, np.sign(net))
    matches = facing == wanted[group]
    keep = np.full(len(start), -1, dtype=np.int64)
    at = np.flatnonzero(matches)[::-1]
    keep[group[at]] = order[at]
    kept = np.sort(keep[keep >= 0])
    notes.append(
        "kept one side of each triangle of a mesh that is drawn two-sided"
        if two_sided
        else f"dropped {counted(len(faces) - len(kept), 'duplicate triangle')}"
    )
    return faces[kept]


def _apart(triangles: NDArray[np.int64], chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which (T,) of the chosen triangles (T, 3) hang together by their corners with chosen ones only."""
    count = int(triangles.max()) + 1
    own = triangles[chosen]
    group = components(count, own[:, [0, 1]].ravel(), own[:, [1, 2]].ravel())
    met = np.zeros(count, dtype=bool)
    met[group[triangles[~chosen]]] = True
    return chosen & ~met[group[triangles[:, 0]]]


def weld_boundary(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Close cracks: join vertices on open edges that lie within 1e-5 of one another."""
    from scipy.spatial import cKDTree

    rim = np.unique(edges.open_half_edges)
    if len(rim) == 0:
        return vertices, edges
    pairs = cKDTree(vertices[rim]).query_pairs(_WELD, output_type="ndarray")
    if len(pairs) == 0:
        return vertices, edges
    label = components(len(rim), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(label, return_index=True)
    target = np.arange(len(vertices))
    target[rim] = rim[first[label]]
    notes.append(f"welded {counted(len(rim) - len(first), 'vertex', 'vertices')} along cracks")
    vertices, faces = merge_vertices(vertices, drop_doubles(target[edges.faces], []), [])
    return vertices, EdgeTable(faces)
