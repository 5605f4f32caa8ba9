"""Shapes with many holes of one form, fitted with and without looking for these.

    python benchmarks/perforations.py [--quality Q] [--picture FILE]

A bracket of two plates, lying and turned to any side, an enclosure with slots, a grille of hexagons, a block
with blind holes, a flywheel and a sieve, made as a CAD program would mesh them. Columns: holes, and for
either way parts, the most copies of a part that is subtracted, IoU, bi-surface IoU, largest deviation, CPU
seconds.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from unittest.mock import patch

import numpy as np
from fit import machine
from manifold3d import CrossSection, Manifold
from scipy.spatial.transform import Rotation

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.meshing.manifolds import as_mesh
from partwright.render import preview, sheet, write_png
from partwright.superfrusta.flat_tree import flattened

CHORDS = 48  # a turn
PANEL = 300, 230  # pixels
LOOKED_FOR = "partwright.superfrusta.hole_search.hole_patterns"


@dataclass(frozen=True)
class Side:
    """A fit. copies: of the part that is subtracted most often."""

    parts: int
    copies: int
    iou: float
    surface: float
    deviation: float
    seconds: float

    @property
    def cells(self) -> list[str]:
        return [str(self.parts), str(self.copies), f"{self.iou:.4f}", f"{self.surface:.4f}",
                f"{self.deviation:.2f}", f"{self.seconds:.1f}"]  # fmt: skip


def block(x: float, y: float, z: float) -> Manifold:
    return Manifold.cube((x, y, z), True)


def rod(radius: float, height: float) -> Manifold:
    return Manifold.cylinder(height, radius, radius, CHORDS, True)


def at(body: Manifold, places: Iterator[tuple[float, float]]) -> Manifold:
    return Manifold.compose([body.translate((x, y, 0)) for x, y in places])


def grid(columns: int, rows: int, pitch: float, shift: float = 0.0) -> Iterator[tuple[float, float]]:
    """Places about the origin; shift: of every second column."""
    for i, j in product(range(columns), range(rows)):
        yield pitch * (i - (columns - 1) / 2), pitch * (j - (rows - 1) / 2) + shift * (i % 2)


def bracket() -> tuple[Manifold, int]:
    body = block(120, 80, 4) + block(4, 80, 60).translate((-58, 0, 28))
    return body - at(rod(4, 20), grid(9, 6, 11.5, 5)), 54


def turned_bracket() -> tuple[Manifold, int]:
    body, holes = bracket()
    turn = Rotation.from_rotvec(0.7 * np.array([1, 0.4, 0.2]) / np.linalg.norm([1, 0.4, 0.2]))
    return body.transform(np.column_stack([turn.as_matrix(), np.zeros(3)])), holes


def enclosure() -> tuple[Manifold, int]:
    """An open box with posts and slots through two of its walls."""
    walls = block(140, 90, 50) - block(134, 84, 50).translate((0, 0, 3))
    walls -= Manifold.compose([block(4, 200, 28).translate((13 * k - 45, 0, 2)) for k in range(8)])
    corners = [(60 * x, 35 * y) for x, y in product((-1, 1), repeat=2)]
    posts = at((rod(5, 40) - rod(2, 60)).translate((0, 0, -5)), iter(corners))
    return walls + posts, 20


def grille() -> tuple[Manifold, int]:
    return block(100, 100, 6) - at(
        CrossSection.circle(5, 6).extrude(30).translate((0, 0, -15)), grid(8, 8, 11)
    ), 64


def drilled() -> tuple[Manifold, int]:
    return block(100, 60, 30) - at(rod(4, 40).translate((0, 0, 15)), grid(7, 4, 14)), 28


def flywheel() -> tuple[Manifold, int]:
    turns = np.arange(6) * np.pi / 3
    large = at(rod(11, 30), zip(37 * np.cos(turns), 37 * np.sin(turns), strict=True))
    small = at(rod(2, 30), zip(52 * np.cos(turns + 0.5), 52 * np.sin(turns + 0.5), strict=True))
    return rod(60, 8) + rod(15, 24) - rod(7, 50) - large - small, 12


def sieve() -> tuple[Manifold, int]:
    return block(120, 120, 3) - at(rod(2.2, 20), grid(15, 15, 7)), 225


SHAPES: tuple[Callable[[], tuple[Manifold, int]], ...] = (
    bracket, turned_bracket, enclosure, grille, drilled, flywheel, sieve
)  # fmt: skip


def fitted(shape: pw.Shape, quality: str) -> tuple[Side, np.ndarray]:
    """The fit's numbers, and a picture of the shape and its parts."""
    started = time.process_time()
    result = pw.fit(shape, quality=quality)
    seconds = time.process_time() - started
    cuts = [len(part.copies) for part, added in flattened(result.assembly) if not added]
    scores = result.scores
    whole = preview(shape, result.assembly, panel=PANEL)
    side = Side(
        len(result.assembly), max(cuts, default=0), scores.iou, scores.bi_surface_iou,
        100 * scores.max_deviation_share, seconds,
    )  # fmt: skip
    return side, whole[-PANEL[1] :, : 2 * PANEL[0]]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quality", default="normal")
    parser.add_argument("--names", default=",".join(make.__name__ for make in SHAPES), metavar="A,B")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results/perforations.md")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="PNG of the shapes and their parts")
    options = parser.parse_args()
    lines, pictures = [], {}
    for make in SHAPES:
        if make.__name__ not in options.names.split(","):
            continue
        body, holes = make()
        name = make.__name__.replace("_", " ")
        shape = pw.load_shape(as_mesh(body), unit="mm")
        now, pictures[name] = fitted(shape, options.quality)
        with patch(LOOKED_FOR, lambda *_: []):
            without, _ = fitted(shape, options.quality)
        lines.append(f"| {' | '.join([name, str(holes), *without.cells, *now.cells])} |")
        print(lines[-1], flush=True)
    columns = ["parts", "copies", "IoU", "bi-surface", "off, %", "CPU s"]
    head = ["shape", "holes", *(f"{one}, without" for one in columns), *columns]
    text = [
        "# Many holes of one form",
        "",
        f"`python benchmarks/perforations.py --quality {options.quality}` on {machine()}.",
        "",
        "Without and with looking for them; copies: of the part that is subtracted most often.",
        "",
        f"| {' | '.join(head)} |",
        f"|---|{'---:|' * (len(head) - 1)}",
        *lines,
        "",
    ]
    write_bytes(options.output, "\n".join(text).encode())
    if options.picture:
        write_png(options.picture, sheet(list(pictures.values()), list(pictures), columns=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
