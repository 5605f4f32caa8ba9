"""Parts of known features as STEP, beside what `detect_primitives` of build123d and CADFit find in the same
meshes.

    python benchmarks/rivals.py --count 8
    python benchmarks/rivals.py --count 8 --cadfit CHECKOUT --cadfit-python PYTHON

The parts are those of benchmarks/known_features.py, so the faces that were drawn are known: those of the
STEP file of the drawn part. Ours is a fit of solids at draft quality as a STEP file. `detect_primitives`
(Apache-2.0) takes a mesh as a solid of triangles and returns analytic faces, planes as rectangles and
cylinders all around, and the triangles that it leaves; whether all of these sew to a closed, valid solid is
asked of OpenCASCADE. CADFit, of which nothing is here (benchmarks/cadfit.py), writes a program, and its solid
is asked the same. Without a checkout its columns are left out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import trimesh
from cadfit import Cadfit, cadfit
from drawn_parts import drawn_part
from fit import machine
from step import faces_of

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.meshing import mesh_assembly

_SEGMENTS = 128
_SEWN = 1e-3  # of the longest side: gaps that are closed


@dataclass(frozen=True)
class Ours:
    """A STEP file: faces, whether it is valid, and the fit's IoU."""

    faces: int
    valid: bool
    iou: float
    seconds: float


@dataclass(frozen=True)
class Theirs:
    """Faces found; triangles left and their share of the area; whether both sew to a valid closed solid."""

    faces: int
    left: int
    left_area: float
    solid: bool
    seconds: float


def ours(mesh: trimesh.Trimesh, folder: Path) -> Ours:
    started = time.process_time()
    result = pw.fit(pw.load_shape(mesh, unit="mm"), "solids", quality="draft")
    file = folder / "ours.step"
    pw.export(result.assembly, file)
    seconds = time.process_time() - started
    valid, _, kinds = faces_of(file)
    return Ours(sum(kinds.values()), valid, result.scores.iou, seconds)


def theirs(mesh: trimesh.Trimesh, folder: Path) -> Theirs:
    from build123d import Mesher, detect_primitives

    file = folder / "mesh.stl"
    mesh.export(file)
    started = time.process_time()
    found, left, _ = detect_primitives(Mesher().read(str(file))[0])
    seconds = time.process_time() - started
    area = sum(face.area for face in left) / mesh.area
    return Theirs(
        len(found), len(left), area, sews([*found, *left], _SEWN * np.ptp(mesh.bounds, 0).max()), seconds
    )


def sews(faces: Sequence[object], within: float) -> bool:
    """Whether faces of build123d sew to one shell without free edges that bounds a valid solid."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.TopAbs import TopAbs_SHELL
    from OCP.TopoDS import TopoDS

    sewing = BRepBuilderAPI_Sewing(within)
    for face in faces:
        sewing.Add(face.wrapped)  # type: ignore[attr-defined]
    sewing.Perform()
    shell = sewing.SewedShape()
    if sewing.NbFreeEdges() or shell.IsNull() or shell.ShapeType() != TopAbs_SHELL:
        return False
    return bool(BRepCheck_Analyzer(BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid()).IsValid())


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=8, help="parts, a quarter of each family")
    parser.add_argument("--cadfit", type=Path, metavar="CHECKOUT", help="run it, too")
    parser.add_argument("--cadfit-python", type=Path, default=Path(sys.executable), metavar="PYTHON")
    parser.add_argument("--seconds", type=float, default=2400.0, help="that CADFit has for a part")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results/rivals.md")
    options = parser.parse_args()
    lines: list[str] = []
    rows: list[tuple[int, Ours, Theirs]] = []
    further: list[tuple[int, Cadfit]] = []
    for number in range(options.count):
        drawn = drawn_part(number)
        mesh = mesh_assembly(drawn.assembly, _SEGMENTS)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "drawn.step"
            pw.export(drawn.assembly, file)
            faces = sum(faces_of(file)[2].values())
            own, other = ours(mesh, Path(folder)), theirs(mesh, Path(folder))
            if options.cadfit:
                python = options.cadfit_python
                third = cadfit(mesh, Path(folder), options.cadfit, python, options.seconds)
                further.append((faces, third))
        rows.append((faces, own, other))
        cells = [f"{drawn.family} {number}", str(len(mesh.faces)), str(faces), str(own.faces)]
        cells += ["yes" if own.valid else "no", f"{own.iou:.4f}", f"{own.seconds:.0f}", str(other.faces)]
        cells += [f"{other.left} ({100 * other.left_area:.0f} %)", "yes" if other.solid else "no"]
        cells += [f"{other.seconds:.0f}", *(further[-1][1].cells if options.cadfit else [])]
        lines.append(f"| {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    write_bytes(options.output, table(rows, further, lines, options.seconds).encode())
    return 0


def table(
    rows: Sequence[tuple[int, Ours, Theirs]],
    further: Sequence[tuple[int, Cadfit]],
    lines: Sequence[str],
    limit: float,
) -> str:
    drawn, own, other = zip(*rows, strict=True)
    count, cadfit_ran = len(rows), bool(further)

    def mean(values: Iterable[float]) -> float:
        return float(np.mean(list(values)))

    off = [
        100 * mean(abs(one.faces / n - 1) for n, one in zip(drawn, side, strict=True))
        for side in (own, other)
    ]
    head = [
        "# Analytic faces from meshes, beside `detect_primitives`",
        "",
        f"`python benchmarks/rivals.py --count {count}` on {machine()}, build123d {version('build123d')}.",
        "",
        f"Valid solids: {sum(o.valid for o in own)} of {count} (IoU {mean(o.iou for o in own):.4f});",
        f"`detect_primitives`: {sum(o.solid for o in other)} of {count}. Its faces are untrimmed, and what",
        "it knows no form for stays triangles: where that is no solid, there is no IoU. On average faces",
        f"are off the drawn part's count by {off[0]:.0f} % and {off[1]:.0f} %, triangles left not counted;",
        f"CPU seconds are {mean(o.seconds for o in own):.0f} and {mean(o.seconds for o in other):.0f}.",
        *told(further, limit),
        "",
        "| part | triangles | faces drawn | ours: faces | valid | IoU | CPU s | detect_primitives: faces "
        "| triangles left (of the area) | solid | CPU s |"
        + " CADFit: faces | valid | IoU | CPU s |"
        * cadfit_ran,
        "|---|---:|---:|---:|---|---:|---:|---:|---:|---|---:|" + "---:|---|---:|---:|" * cadfit_ran,
    ]
    return "\n".join([*head, *lines]) + "\n"


def told(further: Sequence[tuple[int, Cadfit]], limit: float) -> list[str]:
    """What is said of CADFit."""
    if not further:
        return ["CADFit was not run with this table; docs/solids-measured.md says what it made of one part."]
    made = [(faces, one) for faces, one in further if one.faces is not None and one.iou is not None]
    lines = [
        "CADFit (CC BY-NC 4.0: run, not copied; one process, its filter of loops off, as it is by default,",
        f"{limit:.0f} s by the clock a part): {sum(one.valid for _, one in made)} of {len(further)} valid",
    ]
    if not made:
        return [*lines[:-1], f"{lines[-1]}."]
    off = 100 * np.mean([abs(one.faces / faces - 1) for faces, one in made if one.faces is not None])
    iou = np.mean([one.iou for _, one in made if one.iou is not None])
    seconds = np.mean([one.seconds for _, one in made])
    return [*lines, f"solids; of those IoU {iou:.4f}, faces {off:.0f} % off, {seconds:.0f} CPU s."]


if __name__ == "__main__":
    sys.exit(main())
