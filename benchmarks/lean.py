"""What files of fits save by meshes with no more triangles than they need, and how far these move.

    python benchmarks/lean.py --shapes FOLDER --sets toys,cad --fits FITS

Of each assembly its whole surface, as in surface.ply, and its parts, as in parts.glb: triangles before and
after, the seconds of the processor that it takes to leave them out, and how far 20,000 points of the lean
surface are from the full one, in its cells (a 128th of the longest side). The table goes to
benchmarks/results/lean.md.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from dataclasses import astuple, dataclass

import numpy as np
import trimesh
from fitted import command, fits, parser

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError
from partwright.meshing import lean_assembly, lean_part, mesh_assembly, mesh_part
from partwright.shapes.distance import MeshDistance

CELLS, PART, POINTS = 128, 32, 20_000
COLUMNS = ("surface", "lean", "off, cells", "at most", "seconds", "parts", "lean")
HEADER = f"| shape | {' | '.join(COLUMNS)} |"
RULE = "|---|" + len(COLUMNS) * "---:|"


@dataclass(frozen=True)
class Saved:
    """Triangles; how far the lean surface is off the full one, on average and at most, in cells."""

    surface: float
    lean: float
    off: float
    furthest: float
    seconds: float
    parts: float
    lean_parts: float

    def __str__(self) -> str:
        off = f"{self.off:.4f} | {self.furthest:.3f} | {self.seconds:.2f}"
        return f"{self.surface:,.0f} | {self.lean:,.0f} | {off} | {self.parts:,.0f} | {self.lean_parts:,.0f}"


def saved(assembly: Assembly) -> Saved:
    full = mesh_assembly(assembly, CELLS)
    began = time.process_time()
    lean = lean_assembly(assembly, CELLS, mesh=full)
    seconds = time.process_time() - began
    assert lean.is_volume
    points, _ = trimesh.sample.sample_surface(lean, POINTS, seed=0)
    faces = np.asarray(full.faces, dtype=np.int64)
    off = MeshDistance(np.asarray(full.vertices), faces, faces, closed=False).exact(points)
    off *= CELLS / np.ptp(full.bounds, axis=0).max()
    counts = np.zeros(2)
    for part in assembly.parts:
        with suppress(NoSurfaceError):
            alone = Part(part.field)
            counts += [len(mesh_part(alone, PART).faces), len(lean_part(alone, PART).faces)]
    return Saved(
        len(full.faces), len(lean.faces), float(off.mean()), float(off.max()), seconds, *counts.tolist()
    )


def main() -> int:
    options = parser(__doc__, "lean.md").parse_args()
    found = [(entry.name, saved(pw.load_assembly(path))) for entry, path in fits(options)]
    mean = Saved(*np.array([astuple(one) for _, one in found]).mean(axis=0).tolist())
    lines = ["# Triangles that files of fits do without", "", command("lean.py", options), "", HEADER, RULE]
    lines += [f"| {name} | {one} |" for name, one in [*found, (f"**mean of {len(found)}**", mean)]]
    write_bytes(options.output, "\n".join([*lines, ""]).encode())
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
