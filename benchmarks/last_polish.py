"""What the last polish brings: each fit is scored as it is before and after it; nothing else differs.

    python benchmarks/last_polish.py --shapes FOLDER --sets toys,cad --seed 1

Searches are chaotic: another machine, which rounds otherwise, ends elsewhere for some shapes, and what two
runs differ by says little. Here each shape is fitted once, in this process. The table goes to
benchmarks/results/last_polish.md.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from statistics import mean
from typing import Any
from unittest import mock

import numpy as np
from fit import OWN_SHAPES, find_shapes

import partwright as pw
from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.metrics.bi_surface import BI_SURFACE_IOU
from partwright.metrics.comparison import Comparison
from partwright.metrics.iou import IOU
from partwright.metrics.overlap import overlap
from partwright.shapes import Shape
from partwright.superfrusta import resfit
from partwright.superfrusta.outcome import assembly_of

TARGET = Path(__file__).parent / "results" / "last_polish.md"
LONGEST = 1.8  # unit lengths, of the longest side
HEADER = "| shape | parts | IoU | bi-surface IoU | max deviation % | sticks out % | overlap | seconds | of |"
DIGITS = (4, 4, 2, 2, 3)


@dataclass(frozen=True)
class Scored:
    iou: float
    bi_surface_iou: float
    deviation: float
    protrusion: float
    overlap: float

    @classmethod
    def of(cls, assembly: Assembly, shape: Shape, seed: int) -> Scored:
        pair = Comparison(assembly, shape, seed=seed)
        off = pair.deviation
        lengths = (100 / LONGEST * length for length in (off.maximum, off.protrusion))
        return cls(IOU(pair), BI_SURFACE_IOU(pair), *lengths, overlap(assembly))


@dataclass(frozen=True)
class Row:
    """Seconds are CPU time: of the last polish, and of the whole fit."""

    name: str
    parts: float
    before: Scored
    after: Scored
    seconds: float
    fit: float

    @property
    def line(self) -> str:
        pairs = zip(astuple(self.before), astuple(self.after), DIGITS, strict=True)
        cells = (f"{one:.{digits}f} -> {other:.{digits}f}" for one, other, digits in pairs)
        return " | ".join(
            [f"| {self.name}", f"{self.parts:.4g}", *cells, f"{self.seconds:.2f}", f"{self.fit:.1f} |"]
        )


def fitted(name: str, shape: Shape, seed: int) -> Row:
    polished, before, seconds = resfit.last_polished, [], 0.0

    def watched(shape: Shape, samples: Any, leaves: Any, settings: Any, moving: Any) -> Any:
        nonlocal seconds
        rows = np.stack([leaf.row for leaf in leaves])
        before.append(assembly_of(shape, rows, settings, moves=[leaf.moves for leaf in leaves]))
        start = time.process_time()
        found = polished(shape, samples, leaves, settings, moving)
        seconds = time.process_time() - start
        return found

    start = time.process_time()
    with mock.patch.object(resfit, "last_polished", watched):
        result = pw.fit(shape, seed=seed, threads=1)
    whole = time.process_time() - start
    scored = (Scored.of(one, shape, seed) for one in (before[0], result.assembly))
    return Row(name, len(result.assembly), *scored, seconds, whole)


def mean_of(name: str, rows: Sequence[Row]) -> Row:
    def scored(some: Sequence[Scored]) -> Scored:
        return Scored(*(mean(column) for column in zip(*map(astuple, some), strict=True)))

    sides = scored([row.before for row in rows]), scored([row.after for row in rows])
    parts, seconds, fit = (mean(getattr(row, key) for row in rows) for key in ("parts", "seconds", "fit"))
    return Row(f"**{name}: mean of {len(rows)}**", parts, *sides, seconds, fit)


def page(sets: dict[str, list[Row]], command: str) -> str:
    lines = [
        "# What the last polish brings",
        "",
        f"`{command}`. Before and after it, of the same fits. Deviations are in % of the longest side.",
        "Seconds are those of the last polish on one core, and of the whole fit but for Python's start.",
        "",
        HEADER,
        "|---" * (HEADER.count("|") - 1) + "|",
    ]
    for name, rows in sets.items():
        lines += [row.line for row in [*rows, *([mean_of(name, rows)] if rows else [])]]
    return "\n".join([*lines, ""])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER")
    parser.add_argument("--sets", default="", metavar="A,B")
    parser.add_argument("--names", default="", metavar="A,B")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    sets, names = ({*filter(None, text.split(","))} for text in (options.sets, options.names))
    command = f"python benchmarks/last_polish.py --shapes {options.shapes.name} --seed {options.seed}"
    command += "".join(
        f" --{key} {value}" for key, value in (("sets", options.sets), ("names", options.names)) if value
    )
    found: dict[str, list[Row]] = {}
    for entry in find_shapes(options.shapes, sets, names):
        row = fitted(entry.name, pw.load_shape(entry.path), options.seed)
        found.setdefault(entry.set, []).append(row)
        print(row.line, flush=True)
        write_bytes(TARGET, page(found, command).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
