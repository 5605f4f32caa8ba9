"""Fits as STEP: whether the solid is valid, what its faces are, and its volume beside the assembly's.

    python benchmarks/solids.py --shapes FOLDER --sets cad --variants solids --fits FITS
    python benchmarks/step.py --shapes FOLDER --sets cad --fits FITS/solids

FITS/solids/NAME/assembly.json is exported, and the file is read again by the CAD kernel.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from fitted import command, fits, parser

import partwright as pw
from partwright.atomic_io import report_path, write_bytes
from partwright.meshing import mesh_csg

WITHIN = 0.005  # of the volume
CHORD = 2e-5  # of the longest side: how far the mesh of the assembly may lie from it
NAMES = ("plane", "cylinder", "cone", "sphere", "torus", "revolution", "other")


def faces_of(path: Path) -> tuple[bool, float, Counter[str]]:
    """Whether the solid in a STEP file is valid, its volume, and its faces by kind."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    solid = reader.OneShape()
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties)
    kinds: Counter[str] = Counter()
    explorer = TopExp_Explorer(solid, TopAbs_FACE)
    while explorer.More():
        kind = BRepAdaptor_Surface(TopoDS.Face(explorer.Current())).GetType().name.lower()
        kinds[next((name for name in NAMES if name in kind), "other")] += 1
        explorer.Next()
    return BRepCheck_Analyzer(solid).IsValid(), properties.Mass(), kinds


def row(name: str, assembly: Path, shape: Path, folder: Path) -> tuple[str, bool]:
    """A line of the table, and whether the file is as it should be."""
    started, file = time.process_time(), folder / f"{name}.step"
    whole = pw.load_assembly(assembly)
    pw.export(whole, file)
    valid, volume, kinds = faces_of(file)
    seconds = time.process_time() - started
    longest = float(np.ptp(np.array(whole.bounds()), axis=0).max())
    own = volume / mesh_csg(whole, CHORD * longest).volume
    share = volume / pw.load_shape(shape).volume
    report = report_path(file)
    changed = json.loads(report.read_text("utf-8"))["approximated"] if report.exists() else []
    facets = sum(len(change["parts"]) for change in changed if change["to"] == "flat facets")
    good = valid and abs(own - 1) <= WITHIN and not facets and not kinds["other"]
    cells = [name, str(len(whole)), "yes" if valid else "no", f"{100 * (own - 1):+.2f}"]
    cells += [f"{100 * (share - 1):+.2f}", str(facets or "")]
    cells += [str(kinds[kind] or "") for kind in NAMES]
    return f"| {' | '.join(cells)} | {seconds:.1f} |", good


def main() -> int:
    options = parser(__doc__, "step.md").parse_args()
    lines, good, tried = [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for entry, assembly in fits(options):
            line, fine = row(entry.name, assembly, entry.path, Path(folder))
            lines.append(line)
            good, tried = good + fine, tried + 1
            print(line, flush=True)
    head = [
        "# Fits of solids as STEP",
        "",
        command("step.py", options),
        "",
        f"{good} of {tried} are valid, without facets, analytic, and of the assembly's volume to "
        f"{100 * WITHIN:g} %. Volume against that of the assembly, which the export answers for, and of the "
        "input, which the fit does; parts that became facets, copies counted; faces by their surface; "
        "CPU seconds of export and reading.",
        "",
        f"| shape | parts | valid | volume % | of the input | facets | {' | '.join(NAMES)} | CPU s |",
        "|---|---:|---|---:|---:|---:|" + "---:|" * (len(NAMES) + 1),
    ]
    write_bytes(options.output, ("\n".join([*head, *lines]) + "\n").encode())
    return int(good < tried)


if __name__ == "__main__":
    sys.exit(main())
