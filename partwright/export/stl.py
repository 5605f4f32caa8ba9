"""STL: the blended surface, binary. The format has single precision and no unit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from partwright.meshing import mesh_assembly
from partwright.writing import write_bytes

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path, resolution: int = 128) -> None:
    """Write the watertight surface in the assembly's own units and place."""
    from trimesh.exchange.stl import export_stl

    write_bytes(path, export_stl(mesh_assembly(assembly, resolution)))
