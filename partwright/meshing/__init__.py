"""Fields to triangles: sparse marching cubes that is closed for every field."""

from __future__ import annotations

from partwright.meshing.assemblies import mesh_assembly, mesh_part
from partwright.meshing.marching import mesh_field
from partwright.meshing.occupancy import occupancy_grid

__all__ = ["mesh_assembly", "mesh_field", "mesh_part", "occupancy_grid"]
