"""PLY: the blended surface, binary, with double coordinates so that far places keep their digits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.pieces import one_surface
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write(assembly: Assembly, path: str | Path, by_part: bool = False, resolution: int | None = None) -> None:
    """Write the surface, watertight, in the assembly's own units and place.

    by_part: a shell a part, each closed by itself, in the parts' order, instead of the blended surface.
    resolution: cells along the longest side, 128 if not given; with by_part along each part, 32.
    """
    write_mesh(one_surface(assembly, by_part, resolution), path, assembly.unit)


def write_mesh(mesh: trimesh.Trimesh, path: str | Path, unit: str | None = None) -> None:
    """Write a mesh; its unit goes into a comment."""
    faces = np.empty(len(mesh.faces), dtype=_FACE)
    faces["count"], faces["corners"] = 3, mesh.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment unit {unit or 'unknown'}",
        f"element vertex {len(mesh.vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    vertices = np.ascontiguousarray(mesh.vertices, dtype="<f8")
    write_bytes(path, "\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


FORMAT = Format("PLY", write, frozenset({Holds.BLENDS, Holds.LEARNED}))
