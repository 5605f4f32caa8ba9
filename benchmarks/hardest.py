"""The twelve shapes that a fit does worst on, as pictures with what goes wrong.

    python benchmarks/hardest.py --shapes FOLDER --table benchmarks/results/fit.csv

The worst are those with the lowest mean of IoU and bi-surface IoU in the CSV that benchmarks/fit.py writes;
without such a file every shape is fitted to find them. Each is fitted once more with seed 0, drawn to
docs/images/hardest/NAME.png and described in docs/hardest.md. What goes wrong was written down by people who
looked, in hardest.toml beside this script; where nobody has, a sentence says what can be measured.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tomllib
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import numpy as np
from fit import Entry, find_shapes
from PIL import Image

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.fitting import Result
from partwright.render import preview
from partwright.render.output import write
from partwright.shapes import Shape
from partwright.superfrusta import Settings

HERE = Path(__file__).parent
DOCS = HERE.parent / "docs"
COUNT = 12
PANEL = (300, 300)
LARGEST = 150_000  # bytes a picture
STEPS = np.geomspace(0.002, 0.36, 120)  # along which a wall's far side is looked for, unit frame


@dataclass(frozen=True)
class Hard:
    """A shape and how its fit went. wall: thickness that 5 % of the surface stays under, unit frame."""

    entry: Entry
    shape: Shape
    result: Result
    wall: float

    @property
    def cell(self) -> float:
        """Of the decomposition's grid, unit frame."""
        return self.shape.unit_grid(Settings().resolution).spacing

    @property
    def deviation(self) -> float:
        """The largest, in % of the longest side."""
        return 100 * self.result.scores.max_deviation / float(np.ptp(self.shape.vertices, axis=0).max())


def worst_of_table(table: Path, entries: list[Entry]) -> list[Entry]:
    """By the mean over the seeds. Raises SystemExit where the table has none of the entries."""
    scores: dict[tuple[str, str], list[float]] = defaultdict(list)
    with table.open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            if row["iou"]:
                scores[row["set"], row["name"]].append(float(row["iou"]) + float(row["bi_surface_iou"]))
    known = [entry for entry in entries if (entry.set, entry.name) in scores]
    if not known:
        raise SystemExit(f"{table} holds none of these shapes; run benchmarks/fit.py on them")
    return sorted(known, key=lambda entry: mean(scores[entry.set, entry.name]))[:COUNT]


def worst_by_fitting(entries: list[Entry]) -> list[Entry]:
    """Of twelve or fewer all, as they are."""
    if len(entries) <= COUNT:
        return entries
    scores = {}
    for entry in entries:
        found = pw.fit(pw.load_shape(entry.path)).scores
        scores[entry] = found.iou + found.bi_surface_iou
        print(f"{entry.set}/{entry.name}: {found.iou:.3f}, {found.bi_surface_iou:.3f}", flush=True)
    return sorted(entries, key=lambda entry: scores[entry])[:COUNT]


def wall_thickness(shape: Shape) -> float:
    """Straight inwards from the surface to the other side: what 5 % of it stay under, unit frame."""
    surface = shape.unit_surface(2_000, 0)
    ray = surface.points[:, None] - surface.normals[:, None] * STEPS[:, None]
    outside = shape.unit_distance(ray.reshape(-1, 3).astype(np.float32)).reshape(len(ray), -1) > 0
    through = np.where(outside.any(axis=1), STEPS[outside.argmax(axis=1)], STEPS[-1])
    return float(np.quantile(through, 0.05))


def measured_reason(hard: Hard) -> str:
    """What the numbers say, where nobody has looked yet."""
    scores, parts = hard.result.scores, len(hard.result.assembly)
    if hard.wall < 2 * hard.cell:
        cause = (
            f"Its thinnest walls are {hard.wall:.3f} thick, under two cells of the grid that finds new parts "
            f"({hard.cell:.3f} each), and on a thin wall a small offset costs much IoU."
        )
    elif hard.result.outcome == "budget_reached":
        cause = f"It has more pieces than the {parts} parts that growth found in its rounds."
    elif scores.iou - scores.bi_surface_iou > 0.08:
        cause = f"The volume is right; the surface has finer detail than {parts} parts follow."
    else:
        cause = f"No single cause stands out; {parts} parts were the most that paid for themselves."
    place = "in" if scores.worst_place == "middle" else "at"
    return f"{cause} It is furthest off {place} the {scores.worst_place}."


def draw(hard: Hard, path: Path) -> None:
    """The preview in as many colours as fit into the size, 256 at most."""
    page = preview(hard.shape, hard.result.assembly, hard.result.surface, panel=PANEL)
    image = Image.fromarray(page)

    def save(name: Path) -> None:
        for colours in (256, 160, 96, 64):
            image.quantize(colours, dither=Image.Dither.NONE).save(name, format="PNG", optimize=True)
            if name.stat().st_size < LARGEST:
                return
        raise SystemExit(f"{path.name} stays over {LARGEST} bytes; draw smaller panels")

    write(path, save)


def numbers(hard: Hard) -> str:
    scores = hard.result.scores
    return (
        f"IoU {scores.iou:.3f}, bi-surface IoU {scores.bi_surface_iou:.3f}, {len(hard.result.assembly)} "
        f"parts; furthest off by {hard.deviation:.1f} % of the longest side; walls from {hard.wall:.3f} "
        f"({hard.wall / hard.cell:.1f} cells)"
    )


def document(done: list[Hard], of: int) -> str:
    reasons = tomllib.loads((HERE / "hardest.toml").read_text(encoding="utf-8"))
    which = f"The last {len(done)} of {of} benchmark shapes" if len(done) < of else f"{of} hard shapes"
    lines = [
        "# The hardest shapes",
        "",
        f"{which} by the mean of IoU and bi-surface IoU, worst first, at",
        "default settings. Pictures show input, parts, surface and error: red where the result",
        "covers the input's surface, blue where it misses it. Lengths without a unit are of the unit frame,",
        "whose longest side is 1.8. Made by `python benchmarks/hardest.py`.",
    ]
    for hard in done:
        name = hard.entry.name
        picture = f"![{name}: input, parts, surface, error](images/hardest/{name}.png)"
        reason = reasons.get(name) or measured_reason(hard)
        lines += ["", f"## {name}", "", picture, "", f"{numbers(hard)}.", "", reason]
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    chosen = find_shapes(options.shapes, set(), set(filter(None, options.names.split(","))))
    known = options.table is not None and options.table.is_file()
    entries = worst_of_table(options.table, chosen) if known else worst_by_fitting(chosen)
    pictures = options.docs / "images" / "hardest"
    pictures.mkdir(parents=True, exist_ok=True)
    done: list[Hard] = []
    for entry in entries:
        shape = pw.load_shape(entry.path)
        done.append(Hard(entry, shape, pw.fit(shape), wall_thickness(shape)))
        draw(done[-1], pictures / f"{entry.name}.png")
        print(f"{entry.set}/{entry.name}: {numbers(done[-1])}", flush=True)
    done.sort(key=lambda hard: hard.result.scores.iou + hard.result.scores.bi_surface_iou)
    write_bytes(options.docs / "hardest.md", document(done, len(chosen)).encode())
    keep = {f"{entry.name}.png" for entry in entries}
    for picture in pictures.glob("*.png"):
        if picture.name not in keep:
            picture.unlink()
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only among these shapes")
    option("--table", type=Path, metavar="CSV", help="what benchmarks/fit.py wrote")
    option("--docs", type=Path, default=DOCS, metavar="FOLDER", help="where page and pictures go")
    return result


if __name__ == "__main__":
    sys.exit(main())
