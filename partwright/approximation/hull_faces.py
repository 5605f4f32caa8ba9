"""The planes that bound a convex solid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.manifolds import surface_of
from partwright.shapes.topology import area_vectors

if TYPE_CHECKING:
    from manifold3d import Manifold

_AT_ONCE = 1 << 18  # distances of points to planes, that are kept in mind


def faces_of(hull: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals (F, 3) and offsets (F,) of a convex solid's faces, each plane once.

    Each plane is moved out to the farthest corner, so that slivers, whose normals are rounding, cut nothing
    off.
    """
    corners, faces = surface_of(hull)
    normals = area_vectors(corners[faces])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals[length[:, 0] > 0] / length[length[:, 0] > 0]
    _, first = np.unique(np.round(normals, 9), axis=0, return_index=True)
    normals = normals[np.sort(first)]
    return normals, (corners @ normals.T).max(axis=0)


def beyond_faces(points: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """(N,) how far points (N, 3) are beyond any of the planes (F, 3), (F,) at most; -inf without planes."""
    most = np.full(len(points), -np.inf)
    count = max(1, _AT_ONCE // max(len(normals), 1))
    for start in range(0, len(points) if len(normals) else 0, count):
        some = slice(start, start + count)
        most[some] = (points[some] @ normals.T - offsets).max(axis=1)
    return most
