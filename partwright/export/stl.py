"""STL: the blended surface, binary. The format has single precision and no unit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from partwright.approximation.pieces import one_surface
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path, by_part: bool = False, resolution: int | None = None) -> None:
    """Write the surface, watertight, in the assembly's own units and place.

    by_part: a shell a part, each closed by itself, in the parts' order, instead of the blended surface.
    resolution: cells along the longest side, 128 if not given; with by_part along each part, 32.
    """
    from trimesh.exchange.stl import export_stl

    write_bytes(path, export_stl(one_surface(assembly, by_part, resolution)))


FORMAT = Format("STL", write, frozenset({Holds.BLENDS, Holds.LEARNED}))
