"""Which way triangles face: one way within a body, and outwards unless the body is a cavity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.cleaning import counted
from partwright.shapes.topology import EdgeTable, area_vectors, doubled_areas, signed_volumes

_PROBES = 32  # vertices of a body that are looked at to see whether another body contains it
_MAJORITY = 0.75  # share of a patch's triangles that must agree before its facing in the file is believed
_CLEARLY_INWARD = -0.02  # signed volume of an open body over area^1.5; a sphere has +0.094


def orient(vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]) -> EdgeTable:
    """Triangles with consistent winding, facing outwards; cavities keep facing into the hollow."""
    edges = _make_consistent(vertices, edges, notes)
    faces = edges.faces
    volume = signed_volumes(vertices, faces, edges.bodies)
    area = _areas(vertices, faces, edges.bodies)
    inward = edges.open_bodies & (volume < _CLEARLY_INWARD * area**1.5)
    closed = np.flatnonzero(~edges.open_bodies)
    # A cavity belongs to the body around it: whatever is nested in an inverted body is inverted with it.
    root = outermost(vertices, faces, edges.bodies, closed, volume)
    inward[closed] = volume[root] < 0
    if not inward.any():
        return edges
    notes.append(
        f"turned {counted(int(np.count_nonzero(inward)), 'inside-out body', 'inside-out bodies')} around"
    )
    faces = faces.copy()
    turned = inward[edges.bodies]
    faces[turned] = faces[turned, ::-1]
    return EdgeTable(faces)


def _make_consistent(vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]) -> EdgeTable:
    """Flip triangles so that neighbours agree, following the clear majority in the file, else facing out."""
    import igl

    faces = edges.faces
    if len(edges.inconsistent_faces) == 0:
        return edges
    affected = np.isin(edges.bodies, np.unique(edges.bodies[edges.inconsistent_faces]))
    old = np.ascontiguousarray(faces[affected])
    new, patch = igl.bfs_orient(old)
    new, patch = np.asarray(new, dtype=np.int64), np.asarray(patch, dtype=np.int64)
    kept = np.bincount(patch, (new == old).all(axis=1)) / np.bincount(patch)
    outward = signed_volumes(vertices, new, patch) > 0
    right = np.where(np.abs(kept - 0.5) > _MAJORITY - 0.5, kept > 0.5, outward)[patch]
    new = np.where(right[:, None], new, new[:, ::-1])
    # bfs_orient turns a triangle by swapping two corners, so compare facing and not the order of corners.
    flipped = int(np.count_nonzero(_facing(vertices, old, new) < 0))
    notes.append(f"turned {counted(flipped, 'triangle')} to face the same way as their neighbours")
    faces = faces.copy()
    faces[affected] = new
    return EdgeTable(faces)


def _facing(vertices: NDArray[np.float64], a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.asarray((area_vectors(vertices[a]) * area_vectors(vertices[b])).sum(axis=1))


def _areas(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], label: NDArray[np.int64]
) -> NDArray[np.float64]:
    return np.bincount(label, doubled_areas(vertices, faces)) / 2


def containers(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    label: NDArray[np.int64],
    bodies: NDArray[np.int64],
) -> list[tuple[int, int]]:
    """(inner, outer) for every two of the closed `bodies` of which one lies wholly within the other."""
    import igl

    if len(bodies) < 2:
        return []
    members = _split(label, bodies)
    boxes = np.array(
        [[vertices[faces[m]].min(axis=(0, 1)), vertices[faces[m]].max(axis=(0, 1))] for m in members]
    )
    probes = [vertices[np.unique(faces[m])] for m in members]
    probes = [p[:: max(1, len(p) // _PROBES)] for p in probes]
    found = []
    for j, member in enumerate(members):
        within = (boxes[:, 0] >= boxes[j, 0]).all(axis=1) & (boxes[:, 1] <= boxes[j, 1]).all(axis=1)
        within[j] = False
        candidates = np.flatnonzero(within)
        if len(candidates) == 0:
            continue
        tree = igl.FastWindingNumberBVH()
        tree.init(np.ascontiguousarray(vertices), np.ascontiguousarray(faces[member]))
        for i in candidates:
            if np.abs(tree.winding_number(np.ascontiguousarray(probes[i]))).min() > 0.75:
                found.append((int(bodies[i]), int(bodies[j])))
    return found


def outermost(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    label: NDArray[np.int64],
    bodies: NDArray[np.int64],
    volume: NDArray[np.float64],
) -> NDArray[np.int64]:
    """The largest body that contains each of the closed `bodies` (or itself)."""
    root = {int(b): int(b) for b in bodies}
    for inner, outer in containers(vertices, faces, label, bodies):
        if abs(volume[outer]) > abs(volume[root[inner]]):
            root[inner] = outer
    return np.array([root[int(b)] for b in bodies], dtype=np.int64)


def _split(label: NDArray[np.int64], bodies: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Face numbers of each body."""
    order = np.argsort(label, kind="stable")
    start = np.searchsorted(label[order], bodies, side="left")
    stop = np.searchsorted(label[order], bodies, side="right")
    return [order[a:b] for a, b in zip(start, stop, strict=True)]


def split_bodies(label: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Face numbers of every body, by body number."""
    return _split(label, np.arange(int(label.max(initial=-1)) + 1))
