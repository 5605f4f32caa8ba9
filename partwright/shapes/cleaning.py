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


def drop_doubles(faces: NDArray[np.int64], notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Without triangles with a repeated corner and triangles that are there more than once; and one side of
    sheets that were dropped.

    Of copies that face the same way one stays. Copies that face opposite ways are the two sides of something
    that encloses nothing, and go together, unless nearly the whole mesh is drawn two-sided, when one side
    stays: those with a free edge are a sheet, others a wall between bodies.
    """
    sound = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    if not sound.all():
        notes.append(f"dropped {counted(int(np.count_nonzero(~sound)), 'triangle')} without area")
        faces = faces[sound]
    if len(faces) == 0:
        return faces, faces
    corner = np.sort(faces, axis=1)
    order = np.lexsort(corner.T)
    start = np.flatnonzero(np.r_[True, (np.diff(corner[order], axis=0) != 0).any(axis=1)])
    if len(start) == len(faces):
        return faces, faces[:0]
    first = np.argmin(faces, axis=1)
    facing = np.where(
        np.take_along_axis(faces, ((first + 1) % 3)[:, None], axis=1)[:, 0] == corner[:, 1], 1, -1
    )[order]
    group = np.repeat(np.arange(len(start)), np.diff(np.r_[start, len(faces)]))
    net = np.bincount(group, facing, len(start))
    mixed = np.bincount(group, minlength=len(start)) > np.abs(net)
    two_sided = float(mixed.mean()) > 0.9
    wanted = np.where(net == 0, 1 if two_sided else 0, np.sign(net))
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
    gone = (net == 0) & (not two_sided)
    return faces[kept], corner[order[start]][_free(corner[order[start]], gone)]


def _free(triangles: NDArray[np.int64], chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which (T,) of the chosen triangles (T, 3) hang together with one that has an edge of its own."""
    if not chosen.any():
        return chosen
    found = np.zeros(len(triangles), dtype=bool)
    found[EdgeTable(triangles).open_faces] = True
    own = np.flatnonzero(chosen)
    body = EdgeTable(triangles[own]).bodies
    found[own] = (np.bincount(body, found[own]) > 0)[body]
    return chosen & found


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
    faces = np.concatenate(drop_doubles(target[edges.faces], []))
    vertices, faces = merge_vertices(vertices, faces, [])
    return vertices, EdgeTable(faces)
