"""Closed meshes as solids of manifold3d, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

_SHARES = (1.0, 0.25, 0.02)  # of a tolerance, that are tried where more of it takes too much away


def closed(vertices: np.ndarray, faces: np.ndarray) -> Manifold:
    """The solid that vertices (V, 3) and faces (F, 3) bound."""
    from manifold3d import Manifold, Mesh64

    # Copies: it takes neither views that are read-only nor arrays of another order.
    return Manifold(Mesh64(np.array(vertices, dtype=np.float64), np.array(faces, dtype=np.uint64)))


def as_manifold(mesh: trimesh.Trimesh) -> Manifold:
    """A closed mesh as the solid that it bounds."""
    return closed(mesh.vertices, mesh.faces)


def surface_of(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) float64 and faces (F, 3) int64."""
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return vertices, np.asarray(mesh.tri_verts, dtype=np.int64)


def as_mesh(solid: Manifold) -> trimesh.Trimesh:
    """The solid's surface, closed, its vertices as they are."""
    import trimesh

    return trimesh.Trimesh(*surface_of(solid), process=False)


def simplified(solid: Manifold, tolerance: float) -> Manifold:
    """With fewer corners, no place of its surface further off than a length; as it is where that fails.

    manifold3d's own may lose a whole wall where many nearly flat triangles meet: a surface that moves by no
    more than the tolerance changes the volume by no more than that times its area.
    """
    volume, most = solid.volume(), tolerance * solid.surface_area()
    for share in _SHARES:
        simple = solid.simplify(share * tolerance)
        if abs(simple.volume() - volume) <= most:
            return simple
    return solid
