"""How well the parts of a fit agree with the parts that people see, on shapes whose parts are labelled.

    python benchmarks/semantics.py --shapes FOLDER [--names ur5,truck_red]

FOLDER/parts/CLASS/NAME holds one mesh a part, named after its label, and their union as _whole.ply. Each
whole is fitted with default settings; its surface is labelled by the nearest part mesh. A curve that descends
from that fit (at draft quality: it is one fit a size) gives the stability of the structure, and the assembly
that has as many parts as there are labels. The table is written to benchmarks/results/semantics.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from statistics import mean

import numpy as np

import partwright as pw
from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.metrics import owners, purity, stability
from partwright.metrics.purity import COUNT
from partwright.shapes import MeshDistance, Shape

TARGET = Path(__file__).parent / "results" / "semantics.md"
WHOLE = "_whole.ply"
HEADERS = (
    "labels", "parts", "IoU", "purity", "floor", "completeness", "parts a label", "labels found",
    "IoU, N = labels", "purity", "completeness", "nesting", "longest plateau",
)  # fmt: skip
NOTES = f"""\
`purity`: share of {COUNT:,} points of the surface whose label is the most frequent one of their part; each
instance of a part counts as one. `floor`: what a single part has. `completeness`: share whose part is
the most frequent one of their label. The columns from `IoU, N = labels` on: of the curve's assembly with as
many parts as labels. `nesting`: volume that keeps to its parent from one size to the next. `longest plateau`:
the count of parts that is the fewest over the widest factor of tolerance, and that factor. These need no
network, only labels: they stand in for the paper's IntraPrim and InterPrim, and compare with neither."""


@dataclass(frozen=True)
class Row:
    """One shape. The last is the factor of tolerance over which `plateau` parts last."""

    labels: float
    parts: float
    iou: float
    purity: float
    floor: float
    completeness: float
    parts_per_label: float
    found: float
    matched_iou: float
    matched_purity: float
    matched_completeness: float
    nesting: float
    plateau: float
    factor: float

    def cells(self) -> Iterator[str]:
        for field, value in zip(fields(self)[:-2], astuple(self)[:-2], strict=True):
            whole = field.name in ("labels", "parts", "parts_per_label")
            yield f"{value:.1f}".removesuffix(".0") if whole else f"{value:.3f}"
        yield f"{self.plateau:.1f} (x {self.factor:.1f})".replace(".0 ", " ")


def labelled(folder: Path, shape: Shape) -> tuple[np.ndarray, np.ndarray, int]:
    """Points (N, 3) of the whole's surface, the index (N,) of the part mesh nearest to each, and how many."""
    points = shape.frame.from_unit(shape.unit_surface(COUNT, 0).points)
    parts = [pw.load_shape(path) for path in sorted(folder.glob("*.ply")) if path.name != WHOLE]
    distance = [MeshDistance(p.vertices, p.faces, p.faces, True).unsigned(points) for p in parts]
    return points, np.argmin(distance, axis=0), len(parts)


def measure(folder: Path) -> Row:
    shape = pw.load_shape(folder / WHOLE)
    points, label, count = labelled(folder, shape)
    result = pw.fit(shape)
    curve = pw.fit(shape, quality="draft", curve=True, start=result.assembly).curve
    matched = next(point for point in curve if point.parts <= count)
    # Mirrored wheels are one part with two instances, and two labels.
    copies = Assembly(tuple(copy for part in result.assembly.parts for copy in part.copies))
    whole = purity(owners(copies, points), label)
    there = purity(owners(matched.assembly, points), label)
    lasting = stability([point.assembly for point in curve], [point.iou for point in curve])
    return Row(
        count, len(result.assembly), result.scores.iou, whole.purity, whole.floor, whole.completeness,
        whole.parts_per_label, whole.found, matched.iou, there.purity, there.completeness, lasting.nesting,
        lasting.longest.parts, lasting.longest.factor,
    )  # fmt: skip


def document(rows: dict[Path, Row], planned: int) -> str:
    lines = ["# Parts against labels", "", "`python benchmarks/semantics.py --shapes FOLDER`."]
    lines += [f"Unfinished: {len(rows)} of {planned} shapes."] if len(rows) < planned else []
    lines += ["", NOTES, "", f"| shape | {' | '.join(HEADERS)} |", f"|---|{'---:|' * len(HEADERS)}"]
    for kind in dict.fromkeys(folder.parent.name for folder in rows):
        members = {folder.name: row for folder, row in rows.items() if folder.parent.name == kind}
        lines += [f"| {name} | {' | '.join(row.cells())} |" for name, row in members.items()]
        average = Row(*(mean(values) for values in zip(*map(astuple, members.values()), strict=True)))
        cells = " | ".join(f"**{cell}**" for cell in average.cells())
        lines.append(f"| **{kind}: mean of {len(members)}** | {cells} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    names = set(filter(None, options.names.split(",")))
    folders = sorted(path.parent for path in (options.shapes / "parts").glob(f"*/*/{WHOLE}"))
    folders = [folder for folder in folders if not names or folder.name in names]
    if not folders:
        raise SystemExit(f"{options.shapes} holds no such shapes: expected parts/CLASS/NAME/{WHOLE}")
    rows: dict[Path, Row] = {}
    for folder in folders:
        rows[folder] = measure(folder)
        print(f"{len(rows)}/{len(folders)} {folder.name}: {', '.join(rows[folder].cells())}", flush=True)
        write_bytes(TARGET, document(rows, len(folders)).encode())
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    result.add_argument("--shapes", type=Path, required=True, metavar="FOLDER", help="holds parts/")
    result.add_argument("--names", default="", metavar="A,B", help="only these shapes")
    return result


if __name__ == "__main__":
    sys.exit(main())
