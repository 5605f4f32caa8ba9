"""How much of people's fine labels comes back when an assembly divides coarse ones (SuperFrusta, Figure 9).

    python benchmarks/enrichment.py --shapes FOLDER [--names ur5,truck_red] --rows rows.jsonl

FOLDER/parts/CLASS/NAME holds one mesh a label, and their union as _whole.ply. Faces of the whole get the
label of the nearest of these meshes; labels are made coarse by keeping the first word of their names:
wheel_front_left is a wheel. Each whole is fitted at draft quality, and `partwright segment --within --copies`
divides the coarse labels by its parts. What --rows holds is not measured again. The table goes to
benchmarks/results/enrichment.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import numpy as np

import partwright as pw
from partwright.cleaning import segment
from partwright.metrics import purity
from partwright.shapes import MeshDistance, Shape

TARGET = Path(__file__).parent / "results" / "enrichment.md"
WHOLE = "_whole.ply"
WAYS = ("coarse labels", "parts alone", "parts within coarse labels")


@dataclass(frozen=True)
class Row:
    """One shape. Of each of `WAYS`: labels, and purity, completeness and share found of the fine labels."""

    shape: str
    fine: int
    iou: float
    ways: list[tuple[int, float, float, float]]


def fine_labels(folder: Path, shape: Shape) -> tuple[np.ndarray, list[str]]:
    """The index (F,) of the mesh nearest to the middle of each face, and the meshes' names."""
    paths = [path for path in sorted(folder.glob("*.ply")) if path.name != WHOLE]
    middles = shape.input_vertices[shape.input_faces].mean(axis=1)
    meshes = [pw.load_shape(path) for path in paths]
    distance = [MeshDistance(m.vertices, m.faces, m.faces, True).unsigned(middles) for m in meshes]
    return np.argmin(distance, axis=0), [path.stem for path in paths]


def measure(folder: Path) -> Row:
    shape = pw.load_shape(folder / WHOLE)
    fine, names = fine_labels(folder, shape)
    coarse = np.array([names[i].split("_")[0] for i in fine])
    a, b, c = shape.input_vertices[shape.input_faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    result = pw.fit(shape, quality="draft")
    assembly = result.assembly.expanded()
    divided = [segment(shape, assembly, within)[0] for within in (None, coarse)]
    found = [np.unique(coarse, return_inverse=True)[1], *divided]
    ways = []
    for labels in found:
        score = purity(labels, fine, area)
        ways.append((len(np.unique(labels)), score.purity, score.completeness, score.found))
    return Row(folder.name, len(names), result.scores.iou, ways)


def document(rows: list[Row]) -> str:
    lines = [
        "# Coarse labels divided by parts",
        "",
        "`python benchmarks/enrichment.py --shapes FOLDER`. Fine labels are people's, coarse ones the first",
        "words of their names. Purity: share of the area whose fine label is the most frequent one of its",
        "label. Completeness: share whose label is the most frequent one of its fine label. Found: share",
        "of the fine labels that are the most frequent one of some label. Fits are of draft quality.",
        "",
        "| shape | fine labels | IoU of the fit | way | labels | purity | completeness | found |",
        "|---|---:|---:|---|---:|---:|---:|---:|",
    ]
    for row in rows:
        for name, (count, pure, complete, found) in zip(WAYS, row.ways, strict=True):
            about = f"| {row.shape} | {row.fine} | {row.iou:.3f} | {name} | {count}"
            lines.append(f"{about} | {pure:.3f} | {complete:.3f} | {found:.2f} |")
    for i, name in enumerate(WAYS):
        own = [mean(row.ways[i][k] for row in rows) for k in range(4)]
        about = f"| **mean of {len(rows)}** | | | {name} | {own[0]:.1f}"
        lines.append(f"{about} | {own[1]:.3f} | {own[2]:.3f} | {own[3]:.2f} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, required=True, metavar="FOLDER", help="holds parts/")
    parser.add_argument("--names", default="", metavar="A,B", help="only these shapes")
    parser.add_argument("--rows", type=Path, required=True, help="measured rows, kept between runs")
    options = parser.parse_args()
    names = set(filter(None, options.names.split(",")))
    folders = sorted(path.parent for path in (options.shapes / "parts").glob(f"*/*/{WHOLE}"))
    kept = options.rows.read_text().splitlines() if options.rows.exists() else []
    rows = [Row(**json.loads(line)) for line in kept]
    for folder in folders:
        if (names and folder.name not in names) or any(row.shape == folder.name for row in rows):
            continue
        rows.append(measure(folder))
        with options.rows.open("a") as file:
            file.write(json.dumps(dataclasses.asdict(rows[-1])) + "\n")
        TARGET.write_text(document(rows), encoding="utf-8")
        print(rows[-1], flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
