"""OBJ: the blended surface as text, coordinates to their last digit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.pieces import surfaces
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path, by_part: bool = False, resolution: int | None = None) -> None:
    """Write the surface, watertight, in the assembly's own units and place.

    by_part: an object (`o NAME`) a part, each closed by itself, instead of one for the blended surface.
    resolution: cells along the longest side, 128 if not given; with by_part along each part, 32.
    """
    lines, first = [f"# unit: {assembly.unit or 'unknown'}"], 1
    for name, mesh in surfaces(assembly, by_part, resolution):
        lines += [f"o {name}"] if name else []
        lines += ["v {!r} {!r} {!r}".format(*vertex) for vertex in np.asarray(mesh.vertices).tolist()]
        lines += ["f {} {} {}".format(*face) for face in (mesh.faces + first).tolist()]
        first += len(mesh.vertices)
    write_bytes(path, ("\n".join(lines) + "\n").encode())


FORMAT = Format("OBJ", write, frozenset({Holds.BLENDS, Holds.LEARNED}))
