"""Wheels whose teeth are known, found again by `--method solids`.

    python benchmarks/wheels.py [--quality Q] [--picture FILE]

Gears, sprockets, knurls, splines, ratchets, ring gears and fans of few and many teeth, meshed as a CAD
program would and turned to any side. Columns: how many have one part that is there as often as there are
teeth, the most sides of any outline, parts and the parts of a drawing, IoU, largest deviation, CPU seconds.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fit import machine
from manifold3d import CrossSection, Manifold, OpType
from scipy.spatial.transform import Rotation

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.fields import Extrusion, Revolution
from partwright.meshing.manifolds import as_mesh
from partwright.render import preview, sheet, write_png

CHORDS = 120  # a turn
COUNTS = 9, 20, 45
Outline = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Row:
    """One wheel. sides: of the outline that has most. drawn: parts by which one would model it."""

    kind: str
    teeth: int
    found: bool
    sides: int
    parts: int
    drawn: int
    iou: float
    deviation: float
    seconds: float


def around(count: int, outline: Outline) -> CrossSection:
    """Copies of a closed outline, by equal turns about the origin."""
    one = CrossSection([outline])
    return sum((one.rotate(360 * k / count) for k in range(1, count)), one)


def disc(radius: float, height: float) -> Manifold:
    return Manifold.cylinder(height, radius, radius, CHORDS)


def tooth(count: int, root: float, tip: float) -> Outline:
    """From within the circle at its roots, a third as wide at the tip."""
    width = math.pi * root / count
    return [(root - 1, -width / 2), (tip, -width / 6), (tip, width / 6), (root - 1, width / 2)]


def gear(count: int) -> Manifold:
    """A disc with teeth, a hub and a bore."""
    teeth = around(count, tooth(count, 20, 22.5)) ^ CrossSection.circle(22.3, CHORDS)
    return disc(20, 8) + teeth.extrude(8) + disc(9, 16) - disc(4, 40).translate((0, 0, -5))


def ring_gear(count: int) -> Manifold:
    """A ring with teeth inside, and bolt holes."""
    teeth = around(count, tooth(count, 20, 22))
    holes = Manifold.batch_boolean(
        [disc(1.5, 20).translate((26 * c, 26 * s, -5)) for c, s in _turns(6)], OpType.Add
    )
    return disc(30, 8) - (disc(20, 20) + teeth.extrude(20)).translate((0, 0, -5)) - holes


def sprocket(count: int) -> Manifold:
    """A disc with round seats for rollers, and a bore."""
    radius = 0.3 * 2 * math.pi * 24 / count
    seats = [disc(radius, 20).translate((24 * c, 24 * s, -5)) for c, s in _turns(count)]
    return disc(24.5, 5) - Manifold.batch_boolean(seats, OpType.Add) - disc(6, 20).translate((0, 0, -5))


def knurl(count: int) -> Manifold:
    """A cap with grooves."""
    radius = 0.25 * 2 * math.pi * 18 / count
    grooves = [disc(radius, 40).translate((18.3 * c, 18.3 * s, -5)) for c, s in _turns(count)]
    return disc(18, 14) - Manifold.batch_boolean(grooves, OpType.Add) - disc(13, 12).translate((0, 0, -1))


def spline(count: int) -> Manifold:
    """A shaft with keys along a part of it."""
    width = 0.4 * 2 * math.pi * 10 / count
    keys = around(count, [(9, -width / 2), (11.5, -width / 2), (11.5, width / 2), (9, width / 2)])
    return disc(10, 30) + keys.extrude(30) + disc(8, 50)


def ratchet(count: int) -> Manifold:
    """Teeth that lean, and a bore."""
    corners = []
    for k in range(count):
        for radius, share in ((17, 0.0), (20, 0.96)):
            angle = 2 * math.pi * (k + share) / count
            corners.append((radius * math.cos(angle), radius * math.sin(angle)))
    return CrossSection([corners]).extrude(6) - disc(4, 20).translate((0, 0, -5))


def fan(count: int) -> Manifold:
    """A disc with a hub, a bore and blades on it."""
    width = min(1.6, 0.4 * 2 * math.pi * 7 / count)
    blades = around(count, [(6, -width / 2), (23, -width / 2), (23, width / 2), (6, width / 2)])
    body = disc(25, 3) + disc(8, 14) + blades.extrude(8).translate((0, 0, 3))
    return body - disc(3, 40).translate((0, 0, -5))


def _turns(count: int) -> Iterator[tuple[float, float]]:
    return ((math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count)) for k in range(count))


WHEELS: dict[Callable[[int], Manifold], int] = {
    gear: 4, ring_gear: 4, sprocket: 3, knurl: 3, spline: 2, ratchet: 3, fan: 2
}  # fmt: skip

PANEL = 300, 230  # pixels


def measured(
    make: Callable[[int], Manifold], count: int, quality: str, turn: Rotation
) -> tuple[Row, np.ndarray]:
    """The wheel's row, and a picture of it and its parts."""
    body = make(count).transform(np.column_stack([turn.as_matrix(), np.zeros(3)]))
    shape = pw.load_shape(as_mesh(body), unit="mm")
    started = time.process_time()
    result = pw.fit(shape, "solids", quality=quality)
    seconds = time.process_time() - started
    parts = result.assembly.parts
    fields = [part.field for part in parts]
    sides = [len(field.profile.corners) for field in fields if isinstance(field, Extrusion | Revolution)]
    row = Row(
        make.__name__.replace("_", " "),
        count,
        any(len(part.copies) == count for part in parts),
        max(sides, default=0),
        len(parts),
        WHEELS[make],
        result.scores.iou,
        100 * result.scores.max_deviation_share,
        seconds,
    )
    whole = preview(shape, result.assembly, panel=PANEL)
    return row, whole[-PANEL[1] :, : 2 * PANEL[0]]


def line(name: str, own: Sequence[Row]) -> str:
    cells = [name, str(len(own)), str(sum(row.found for row in own)), str(max(row.sides for row in own))]
    cells += [f"{np.mean([getattr(row, key) for row in own]):.1f}" for key in ("parts", "drawn")]
    cells += [f"{np.mean([row.iou for row in own]):.4f}", f"{max(row.deviation for row in own):.2f}"]
    return f"| {' | '.join(cells)} | {np.mean([row.seconds for row in own]):.1f} |"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quality", default="normal")
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)), metavar="A,B", help="teeth")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results/wheels.md")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="PNG of the wheels of the second count")
    options = parser.parse_args()
    counts = [int(count) for count in options.counts.split(",")]
    turns = np.random.default_rng(0)
    rows, pictures = [], {}
    for make in WHEELS:
        for count in counts:
            row, seen = measured(make, count, options.quality, Rotation.random(random_state=turns))
            rows.append(row)
            pictures[row.kind, count] = seen
            print(row, flush=True)
    kinds = list(dict.fromkeys(row.kind for row in rows))
    lines = [
        "# Wheels, found again",
        "",
        f"`python benchmarks/wheels.py --quality {options.quality}` on {machine()}.",
        "",
        f"Of {options.counts.replace(',', ', ')} teeth, turned to any side.",
        "",
        "| wheels | made | one part as often as teeth | most sides of an outline | parts | by hand "
        "| IoU | largest deviation, % | CPU s |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        *(line(kind, [row for row in rows if row.kind == kind]) for kind in kinds),
        line("all", rows),
        "",
    ]
    missed = [f"{row.kind} of {row.teeth}" for row in rows if not row.found]
    lines += [f"Not found as such: {', '.join(missed)}.", ""] if missed else []
    write_bytes(options.output, "\n".join(lines).encode())
    if options.picture:
        count = counts[min(1, len(counts) - 1)]
        write_png(options.picture, sheet([pictures[kind, count] for kind in kinds], kinds, columns=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
