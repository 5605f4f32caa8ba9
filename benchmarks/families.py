"""Families: what preparing costs, how well poses agree, and contact sheets.

    python benchmarks/families.py --count 12 [--real FOLDER ...] [--sheets]

Prepares shapes of each made family and each folder of real ones, on one core, with as many samples as the
paper's program takes (525,000), and compares the time with that program's 70 s a shape on one core. Also how
far parts are turned from their family's average pose, which shows whether their axes are named alike. The
table goes to benchmarks/results/families.md, sheets to docs/images/families/. Exits with 1 if any family is
prepared less than 10 times as fast per sample.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.datasets import FAMILIES, FamilyShape, PreparedFamily, family, prepare
from partwright.render import Camera, render_mesh, sheet, write_png

HERE = Path(__file__).parent
SAMPLES = 525_000
PUBLISHED = 70.0 / SAMPLES  # seconds a sample
LEAST = 10.0
HEADERS = (
    *("family", "shapes", "parts", "faces", "CPU s a shape"),
    *("us a sample", "x published", "turn 50 %", "turn max"),
)
PANEL, COLUMNS, ROWS = (230, 200), 6, 4


def main() -> int:
    arguments = _arguments()
    if arguments.sheets:
        for name in FAMILIES:
            write_png(HERE.parent / f"docs/images/families/{name}.png", contact_sheet(name))
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rows, ratios = [], []
    for source in [*FAMILIES, *arguments.real]:
        row, ratio = measured(source, arguments.count)
        rows.append(row)
        ratios.append(ratio)
        print("  ".join(row), flush=True)
    write_bytes(HERE / "results/families.md", table(rows, arguments.count).encode())
    return int(min(ratios) < LEAST)


def measured(source: str, count: int) -> tuple[list[str], float]:
    """The table's cells, and by how much this is faster per sample than the published program."""
    with tempfile.TemporaryDirectory() as folder:
        prepare("mixers", Path(folder) / "warm", count=2, samples=1000, workers=1)  # imports
        start = time.process_time()
        made = prepare(source, Path(folder) / "out", count=count, samples=SAMPLES, workers=1)
        seconds = (time.process_time() - start) / len(made.family)
        for shape in made.refused:
            print(f"{shape.name} is left out: {shape.reason}", file=sys.stderr)
        faces = np.median([len(made.family.load(i).faces) for i in range(len(made.family))])
        turned = turns(made.family)
    ratio = PUBLISHED * SAMPLES / seconds
    cells = [Path(source).name, str(len(made.family)), str(len(made.family.parts)), f"{faces:.0f}"]
    cells += [f"{seconds:.2f}", f"{1e6 * seconds / SAMPLES:.1f}", f"{ratio:.0f}"]
    return [*cells, f"{np.median(turned):.0f}°", f"{turned.max():.0f}°"], ratio


def turns(prepared: PreparedFamily) -> np.ndarray:
    """Degrees between each part that is there and its family's average pose."""
    average = Rotation.from_quat(prepared.average_pose.rotation, scalar_first=True)
    found = []
    for number in range(len(prepared)):
        shape = prepared.load(number)
        apart = (Rotation.from_quat(shape.rotation, scalar_first=True) * average.inv()).magnitude()
        found.append(np.degrees(apart[shape.present == 1]))
    return np.concatenate(found)


def contact_sheet(name: str) -> np.ndarray:
    """The first shapes of a family, coloured by part."""
    shapes = family(name, COLUMNS * ROWS, seed=0)
    return sheet([picture(name, shape) for shape in shapes], columns=COLUMNS)


def picture(name: str, shape: FamilyShape) -> np.ndarray:
    """One shape; a mixer's helix, which hides in its tube, is drawn before it."""
    colours = palette(len(FAMILIES[name].parts))
    meshes, faces = [], []
    for part, mesh in shape.parts.items():
        moved = mesh.copy()
        if part == "helix":
            moved.apply_translation((0, -1.3 * shape.whole.extents[1] - 2, -0.2 * shape.whole.extents[2]))
        meshes.append(moved)
        faces.append(np.tile(colours[FAMILIES[name].parts.index(part)], (len(mesh.faces), 1)))
    camera = Camera(azimuth=40, elevation=26)
    return render_mesh(trimesh.util.concatenate(meshes), camera, PANEL, np.concatenate(faces))


def table(rows: list[list[str]], count: int) -> str:
    lines = [
        "# Preparing families",
        "",
        f"`python benchmarks/families.py --count {count} --real robot_arm`",
        "",
        f"One core, {SAMPLES:,} samples a shape, in CPU seconds for all of it: making or reading the shape,",
        "repair, poses, samples, files. The paper's program takes 70 s to sample as many. `turn`: angle",
        "between a part and its family's average pose; parts whose axes were named differently would be 90°",
        "or 180° apart. A part that is about as wide as long, or round, has no direction of its own, so some",
        "of its turn is free.",
        "",
        f"| {' | '.join(HEADERS)} |",
        f"|{'---|' * len(HEADERS)}",
        *(f"| {' | '.join(row)} |" for row in rows),
    ]
    return "\n".join(lines) + "\n"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=12, help="shapes a made family")
    parser.add_argument("--real", nargs="*", default=[], help="folders of real shapes")
    parser.add_argument("--sheets", action="store_true", help="draw the contact sheets too")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
