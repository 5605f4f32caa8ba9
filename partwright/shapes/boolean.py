"""Overlapping closed bodies to one outer surface, by exact booleans (manifold3d)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.orientation import containers, split_bodies
from partwright.shapes.topology import EdgeTable, compacted, signed_volumes


def unite(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Union of the bodies of a closed surface; the surface itself when nothing overlaps or the union fails.

    A cavity (a body that faces inwards) is taken out of the smallest body around it before the union.
    """
    faces, label = edges.faces, edges.bodies
    bodies = split_bodies(label)
    if len(bodies) == 1:
        return vertices, edges
    volume = signed_volumes(vertices, faces, label)
    solids = _with_cavities(vertices, faces, label, bodies, volume)
    if not _boxes_touch(vertices, faces, [bodies[b] for b in np.flatnonzero(volume > 0)]):
        if len(solids) > 1:
            notes.append(f"{len(solids)} separate bodies are kept as they are")
        return vertices, edges
    union = _boolean_union([_manifold(vertices, faces[solid]) for solid in solids])
    if union is None:
        notes.append(f"{len(solids)} bodies touch or overlap and could not be united exactly")
        return vertices, edges
    notes.append(f"united {len(solids)} bodies that touch or overlap")
    return union


def _with_cavities(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    label: NDArray[np.int64],
    bodies: list[NDArray[np.int64]],
    volume: NDArray[np.float64],
) -> list[NDArray[np.int64]]:
    """Face numbers of each solid body together with the cavities in it."""
    cavities = np.flatnonzero(volume <= 0)
    if len(cavities) == 0:
        return bodies
    home: dict[int, int] = {}
    for inner, outer in containers(vertices, faces, label, np.arange(len(bodies))):
        if volume[inner] <= 0 < volume[outer] and (inner not in home or volume[outer] < volume[home[inner]]):
            home[inner] = outer
    members: dict[int, list[int]] = {int(b): [int(b)] for b in np.flatnonzero(volume > 0)}
    for cavity, solid in home.items():
        members[solid].append(cavity)
    return [np.concatenate([bodies[b] for b in group]) for group in members.values()]


def _boxes_touch(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], solids: list[NDArray[np.int64]]
) -> bool:
    lower = np.array([vertices[faces[s]].min(axis=(0, 1)) for s in solids])
    upper = np.array([vertices[faces[s]].max(axis=(0, 1)) for s in solids])
    for i in range(len(solids) - 1):
        if ((lower[i + 1 :] <= upper[i]) & (upper[i + 1 :] >= lower[i])).all(axis=1).any():
            return True
    return False


def _manifold(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Any:
    import manifold3d

    used, corners = compacted(faces, len(vertices))
    mesh = manifold3d.Mesh64(np.ascontiguousarray(vertices[used]), corners.astype(np.uint64))
    return manifold3d.Manifold(mesh)


def _boolean_union(solids: list[Any]) -> tuple[NDArray[np.float64], EdgeTable] | None:
    """Vertices and triangles of the union, or None where a body is not manifold or the result is open."""
    import manifold3d

    if any(solid.status() != manifold3d.Error.NoError for solid in solids):
        return None
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if union.status() != manifold3d.Error.NoError or union.is_empty():
        return None
    mesh = union.to_mesh64()
    edges = EdgeTable(np.asarray(mesh.tri_verts, dtype=np.int64))
    if edges.balance.any():
        return None
    return np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3].copy(), edges
