"""OBJ: the blended surface as text, coordinates to their last digit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing import mesh_assembly
from partwright.writing import write_bytes

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path, resolution: int = 128) -> None:
    """Write the watertight surface in the assembly's own units and place."""
    mesh = mesh_assembly(assembly, resolution)
    lines = [f"# unit: {assembly.unit or 'unknown'}"]
    lines += ["v {!r} {!r} {!r}".format(*vertex) for vertex in np.asarray(mesh.vertices).tolist()]
    lines += ["f {} {} {}".format(*face) for face in (mesh.faces + 1).tolist()]
    write_bytes(path, ("\n".join(lines) + "\n").encode())
