"""The planes that bound a convex solid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.manifolds import surface_of
from partwright.shapes.topology import area_vectors

if TYPE_CHECKING:
    from manifold3d import Manifold


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
