"""Fields to triangles: exact booleans where they can be had, else marching cubes closed for every field."""

from __future__ import annotations

from partwright.meshing.assemblies import mesh_assembly, mesh_part
from partwright.meshing.csg import has_exact_mesh, mesh_csg
from partwright.meshing.leaner import lean_assembly, lean_part
from partwright.meshing.marching import mesh_field
from partwright.meshing.occupancy import occupancy_grid

__all__ = [
    "has_exact_mesh",
    "lean_assembly",
    "lean_part",
    "mesh_assembly",
    "mesh_csg",
    "mesh_field",
    "mesh_part",
    "occupancy_grid",
]
