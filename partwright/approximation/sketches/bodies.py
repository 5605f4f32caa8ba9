"""The connected bodies of a solid, without the slivers that booleans of nearly equal walls leave."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold, Mesh64

from partwright.meshing.small_components import components
from partwright.shapes.topology import area_vectors


def bodies(solid: Manifold, least: float, thin: float) -> Iterator[tuple[float, Manifold]]:
    """Volume and body of each connected piece of at least the volume `least` that is no thinner than `thin`,
    by twice its volume over its area. Cavities are filled."""
    if solid.is_empty():
        return
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    faces = np.asarray(mesh.tri_verts, dtype=np.int64)
    count, piece = components(faces, len(vertices))
    own = piece[faces[:, 0]]
    corners = vertices[faces]
    cross = area_vectors(corners)
    volume = np.bincount(own, (corners[:, 0] * cross).sum(axis=1) / 6, minlength=count)
    area = np.bincount(own, np.linalg.norm(cross, axis=1) / 2, minlength=count)
    for k in np.flatnonzero((volume > least) & (2 * volume > thin * area)):
        used, index = np.unique(faces[own == k], return_inverse=True)
        body = Manifold(Mesh64(vertices[used], index.reshape(-1, 3).astype(np.uint64)))
        if not body.is_empty():
            yield float(volume[k]), body
