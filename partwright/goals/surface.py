"""The surface that objectives see: a closed mesh, nowhere much coarser than the resolution."""

from __future__ import annotations

import numpy as np
import trimesh

from partwright.assembly import Assembly
from partwright.meshing import mesh_assembly
from partwright.meshing.manifolds import as_manifold, as_mesh
from partwright.meshing.small_components import components
from partwright.render.part_colours import surface_parts

_COARSEST = 3.0  # cells: longer edges, as exact meshes have on flat faces, are cut


def surface_of(assembly: Assembly, resolution: int) -> trimesh.Trimesh:
    """The whole surface, watertight, own units, with edges of at most about three cells.

    resolution: cells along the longest side, as of `mesh_assembly`, whose errors it raises.
    """
    mesh = mesh_assembly(assembly, resolution)
    cell = float(np.ptp(assembly.bounds(), axis=0).max()) / resolution
    if mesh.edges_unique_length.max() <= _COARSEST * cell:
        return mesh
    return as_mesh(as_manifold(mesh).refine_to_length(_COARSEST * cell))


def thin_parts(assembly: Assembly, wall: float) -> list[int]:
    """Leaves with walls thinner than this. Those thinner than a cell are meshed by themselves, too, so
    that the surface does not follow their numbers smoothly."""
    return [i for i, part in enumerate(assembly.parts) if part.field.wall < wall]


def face_labels(assembly: Assembly, mesh: trimesh.Trimesh) -> np.ndarray:
    """(F,) which leaf's own surface each face runs along: an index into `assembly.parts`."""
    normals = np.array(mesh.face_normals)
    normals[~normals.any(axis=1), 2] = 1.0  # faces without area
    return surface_parts(assembly, np.asarray(mesh.triangles_center), normals)


def pieces(mesh: trimesh.Trimesh) -> int:
    """How many separate closed surfaces there are that bound something from outside; hollows do not count."""
    count, piece = components(np.asarray(mesh.faces), len(mesh.vertices))
    if count == 1:
        return 1
    a, b, c = np.moveaxis(np.asarray(mesh.vertices)[mesh.faces], 1, 0)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    volume = np.bincount(piece[mesh.faces[:, 0]], six, minlength=count)
    return int((volume > 0).sum())
