"""What cleaning costs and finds on fitted shapes, and pictures of it before and after.

    python benchmarks/cleaning.py --shapes FOLDER --fits FITS/solids FITS/superfrusta [--pictures]

Every shape of `--shapes` that has a fit NAME/assembly.json in one of the folders of `--fits` (as `partwright
fit SHAPE -o FITS/solids/NAME` writes it) is cleaned against the shape at the default tolerance; a folder's
name says what its fits are. The table goes to
benchmarks/results/cleaning.md; with --pictures, docs/clean-gallery.md shows each result with its numbers.
Seconds are CPU seconds.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

import partwright as pw
from partwright.assembly.palette import palette
from partwright.assembly.profile_numbers import profile_numbers
from partwright.atomic_io import write_bytes
from partwright.cleaning import Cleaned
from partwright.cleaning.dimensions import values
from partwright.export.solid_source import number
from partwright.fields import Extrusion, Field, Revolution, SuperFrustum
from partwright.metrics import Scores
from partwright.render import Camera, sheet
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import look

HERE = Path(__file__).parent
DOCS = HERE.parent / "docs"
PANEL = 320
LONGEST_LIST = 14  # parts shown with their numbers


@dataclass(frozen=True)
class Row:
    """One shape: its fit, what cleaning made of it, and how both score."""

    name: str
    method: str
    fitted: pw.Assembly
    cleaned: Cleaned
    before: Scores
    after: Scores
    seconds: float


def run(name: str, method: str, shape: pw.Shape, fitted: pw.Assembly) -> Row:
    start = time.process_time()
    cleaned = pw.clean(fitted, shape)
    seconds = time.process_time() - start
    before, after = (pw.evaluate(one, shape, emd=False) for one in (fitted, cleaned.assembly))
    return Row(name, method, fitted, cleaned, before, after, seconds)


def named(assembly: pw.Assembly) -> int:
    """Parts that are named solids."""
    return sum(not isinstance(part.field, SuperFrustum) for part in assembly.parts)


def sizes(field: Field) -> list[float]:
    """The numbers of a part, those of its profile if it has one."""
    if isinstance(field, Extrusion | Revolution):
        places = [v for name, v in profile_numbers(field).items() if ".radius." not in name]
        return [*places, field.height] if isinstance(field, Extrusion) else places
    return list(values(field))


def plain_share(assembly: pw.Assembly) -> float:
    """Numbers of at most four digits, of all dimensions and places."""
    found = [v for part in assembly.parts for v in (*sizes(part.field), *part.translation)]
    return float(np.mean([len(number(abs(v)).replace(".", "").strip("0")) <= 4 for v in found]))


def table(rows: list[Row], command: str) -> str:
    lines = [
        "# What cleaning costs and finds",
        "",
        f"`{command}`",
        "",
        "Before and after, at the default tolerance of half a thousandth of the longest side. Plain: numbers",
        "have at most four digits; bi: bi-surface IoU. CPU seconds.",
        "",
        "| shape | fitted as | parts | named solids | plain | relations | IoU | bi | 95 % off | s |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        a, b = row.fitted, row.cleaned.assembly
        lines.append(
            f"| {row.name} | {row.method} | {len(a)} -> {len(b)} | {named(a)} -> {named(b)} | "
            f"{plain_share(a):.0%} -> {plain_share(b):.0%} | {len(row.cleaned.relations)} | "
            f"{row.before.iou:.3f} -> {row.after.iou:.3f} | "
            f"{row.before.bi_surface_iou:.3f} -> {row.after.bi_surface_iou:.3f} | "
            f"{row.before.deviation_95:.4f} -> {row.after.deviation_95:.4f} | {row.seconds:.1f} |"
        )
    iou = np.mean([row.after.iou - row.before.iou for row in rows])
    near = np.mean([row.after.bi_surface_iou - row.before.bi_surface_iou for row in rows])
    lines += ["", f"Mean change of IoU {iou:+.4f}, of bi-surface IoU {near:+.4f}, over {len(rows)} shapes."]
    return "\n".join(lines) + "\n"


def draw(row: Row, shape: pw.Shape, path: Path) -> None:
    """Input, fit and clean assembly, parts in their colours."""
    from partwright.meshing import mesh_assembly

    camera = Camera(up=shape.up or "z", margin=0.08)
    view = camera.fitted(shape.vertices, PANEL, PANEL)
    given = look(Scene(shape.vertices, shape.faces), camera, view, PANEL, PANEL)
    panels = [given.image(np.array((205, 208, 214)))]
    for assembly in (row.fitted, row.cleaned.assembly):
        mesh = mesh_assembly(assembly)
        seen = look(Scene(np.asarray(mesh.vertices), np.asarray(mesh.faces)), camera, view, PANEL, PANEL)
        nearest = np.abs(assembly.part_distances(seen.hits.point)).argmin(axis=0)
        panels.append(seen.image(palette(len(assembly))[nearest]))
    captions = (
        row.name,
        f"before: {len(row.fitted)} parts, IoU {row.before.iou:.3f}",
        f"after: {len(row.cleaned.assembly)} parts, IoU {row.after.iou:.3f}",
    )
    image = Image.fromarray(sheet(panels, captions)).quantize(96, dither=Image.Dither.NONE)
    write(path, lambda name: image.save(name, format="PNG", optimize=True))


def page(rows: list[Row], command: str) -> str:
    lines = [
        "# Cleaned fits",
        "",
        "Input, fit, and the same after `partwright clean --shape`, at the default tolerance; below each,",
        "the first part as the fit left it and all parts as they are now. Lengths are the shapes' own, of",
        f"which the longest side is 1.8. Made by `{command}`.",
    ]
    for row in rows:
        made = row.cleaned.assembly.parts
        lines += ["", f"## {row.name}, fitted as {row.method}", ""]
        lines += [f"![input, fit, clean](images/clean/{row.method}_{row.name}.png)", "", "```"]
        lines += [f"before  {row.fitted.parts[0].describe()}", ""]
        lines += [part.describe() for part in made[:LONGEST_LIST]]
        if len(made) > LONGEST_LIST:
            lines.append(f"... and {len(made) - LONGEST_LIST} more")
        lines += ["```", "", *(f"- {relation}" for relation in row.cleaned.relations[:8])]
        if len(row.cleaned.relations) > 8:
            lines.append(f"- ... and {len(row.cleaned.relations) - 8} more relations")
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    command = "python benchmarks/cleaning.py --shapes SHAPES --fits FITS/solids FITS/superfrusta --pictures"
    chosen = set(filter(None, options.names.split(",")))
    rows = []
    pictures = options.docs / "images" / "clean"
    for folder, path in product(options.fits, sorted(options.shapes.iterdir())):
        fit = folder / path.stem / "assembly.json"
        if not fit.is_file() or (chosen and path.stem not in chosen):
            continue
        fitted = pw.load_assembly(fit)
        shape = pw.load_shape(path, unit=fitted.unit, up=fitted.up)
        rows.append(run(path.stem, folder.name, shape, fitted))
        print(f"{path.stem}: IoU {rows[-1].before.iou:.3f} -> {rows[-1].after.iou:.3f}", flush=True)
        if options.pictures:
            pictures.mkdir(parents=True, exist_ok=True)
            draw(rows[-1], shape, pictures / f"{folder.name}_{path.stem}.png")
    if not rows:
        raise SystemExit(
            f"no shape of {options.shapes} has a fit in {', '.join(map(str, options.fits))}; "
            "run partwright fit first"
        )
    write_bytes(options.output, table(rows, command).encode())
    if options.pictures:
        write_bytes(options.docs / "clean-gallery.md", page(rows, command).encode())
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="meshes, NAME.ply or other")
    option("--fits", type=Path, required=True, nargs="+", metavar="FOLDER", help="NAME/assembly.json of each")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--pictures", action="store_true", help="also draw docs/clean-gallery.md")
    option("--docs", type=Path, default=DOCS, metavar="FOLDER", help="where page and pictures go")
    option("-o", "--output", type=Path, default=HERE / "results" / "cleaning.md", metavar="FILE")
    return result


if __name__ == "__main__":
    sys.exit(main())
