"""How closely meshes follow the surfaces of fits, with triangles across bends halved, and without.

    python benchmarks/refinement.py --shapes FOLDER --sets toys,cad --fits FITS

Of each assembly 60,000 points of its mesh are compared with its field: how far they are off, in the mesh's
cells (a 128th of the longest side), and how much of the mesh is turned by over 20 degrees from the surface,
which is what an eye sees as beads. Seconds are those of the processor. The table goes to
benchmarks/results/refinement.md.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from unittest import mock

import numpy as np
import trimesh
from fitted import command, fits, parser

import partwright as pw
from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.meshing import marching, mesh_assembly

POINTS, STEP, CELLS = 60_000, 1e-4, 128
TURNED = 20.0  # degrees
COLUMNS = ("off, cells", "turned, %", "triangles", "seconds")
HEADER = f"| shape | {' | '.join(COLUMNS)} | refined: {' | '.join(COLUMNS)} |"
RULE = "|---|" + 8 * "---:|"


@dataclass(frozen=True)
class Measured:
    off: float
    """Root mean square, cells."""
    turned: float
    """Per cent of the area."""
    triangles: float
    seconds: float

    def __str__(self) -> str:
        return f"{self.off:.4f} | {self.turned:.2f} | {self.triangles:,.0f} | {self.seconds:.2f}"


def measured(assembly: Assembly) -> Measured:
    began = time.process_time()
    mesh = mesh_assembly(assembly, CELLS, exact=False)
    seconds = time.process_time() - began
    assert mesh.is_volume
    size = float(np.ptp(mesh.bounds, axis=0).max())
    points, face = trimesh.sample.sample_surface(mesh, POINTS, seed=0)
    step = STEP * size * np.eye(3)
    slope = np.stack([field(assembly, points + s) - field(assembly, points - s) for s in step], axis=1)
    along = np.einsum("nd,nd->n", slope, mesh.face_normals[face]) / np.linalg.norm(slope, axis=1)
    off = field(assembly, points) / size * CELLS
    turned = 100 * float((along < np.cos(np.radians(TURNED))).mean())
    return Measured(float(np.sqrt((off**2).mean())), turned, len(mesh.faces), seconds)


def field(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    return np.asarray(assembly.distance(points.astype(np.float32)), dtype=np.float64)


def both(assembly: Assembly) -> tuple[Measured, Measured]:
    """Without and with what halves triangles."""
    mesh_assembly(assembly, CELLS, exact=False)  # parts that come again are remembered: for both alike
    with mock.patch.object(marching, "refined", lambda vertices, faces, *_: (vertices, faces)):
        plain = measured(assembly)
    return plain, measured(assembly)


def mean(of: Sequence[Measured]) -> Measured:
    return Measured(*np.array([astuple(one) for one in of]).mean(axis=0).tolist())


def main() -> int:
    options = parser(__doc__, "refinement.md").parse_args()
    found = [(entry.name, *both(pw.load_assembly(path))) for entry, path in fits(options)]
    _, plain, fine = zip(*found, strict=True)
    lines = ["# Meshes of fits, with triangles across bends halved", ""]
    lines += [command("refinement.py", options), "", HEADER, RULE]
    lines += [f"| {name} | {one} | {other} |" for name, one, other in found]
    lines += [f"| **mean of {len(found)}** | {mean(plain)} | {mean(fine)} |"]
    write_bytes(options.output, "\n".join([*lines, ""]).encode())
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
