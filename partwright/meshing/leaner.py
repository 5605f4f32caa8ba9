"""Meshes with no more triangles than they need: few on what is flat, more where it is bent.

Cubes leave as many on a plain wall as on a fillet. Whoever opens a file edits, downloads and draws them all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.meshing.assemblies import mesh_assembly, mesh_part
from partwright.meshing.csg import has_exact_mesh
from partwright.meshing.manifolds import as_manifold, as_mesh, simplified

if TYPE_CHECKING:
    import trimesh

_OF_A_CELL = 50  # a surface may move by this part of a cell: less is not seen
_OF_WALL = 100  # and by this part of a part's thinnest wall


def lean_part(part: Part, resolution: int = 64) -> trimesh.Trimesh:
    """As `mesh_part`."""
    mesh = mesh_part(part, resolution)
    if has_exact_mesh(part):
        return mesh
    return leaner(mesh, min(_longest(mesh) / resolution / _OF_A_CELL, part.field.wall / _OF_WALL))


def lean_assembly(
    assembly: Assembly | Part, resolution: int = 128, mesh: trimesh.Trimesh | None = None
) -> trimesh.Trimesh:
    """As `mesh_assembly`. mesh: what that gives, if it is known already."""
    mesh = mesh_assembly(assembly, resolution) if mesh is None else mesh
    return mesh if has_exact_mesh(assembly) else leaner(mesh, _longest(mesh) / resolution / _OF_A_CELL)


def leaner(mesh: trimesh.Trimesh, tolerance: float) -> trimesh.Trimesh:
    """A closed mesh without the corners that no place of its surface needs, to within a length.

    As it is where that cannot be done.
    """
    simple = simplified(as_manifold(mesh), tolerance)
    return as_mesh(simple) if 0 < simple.num_tri() < len(mesh.faces) else mesh


def _longest(mesh: trimesh.Trimesh) -> float:
    return float(np.ptp(mesh.bounds, axis=0).max())
