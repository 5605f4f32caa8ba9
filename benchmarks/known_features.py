"""Parts of known features, meshed, fitted by `--method solids` and compared with what was drawn.

    python benchmarks/known_features.py --count 40

A feature is found exactly where the fit has one part of the same sign with as many copies that has at least
half of its numbers to 5 %, and no two features have the same. A number is right within 1 %: a level by 1 % of
the feature's own size along that axis, a diameter, radius, fillet or chamfer by 1 % of itself. Further parts
are those that stand for no feature.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from drawn_parts import FAMILIES, Drawn, Feature, Number, drawn_moulding, drawn_part, moulding, numbers
from fit import machine
from scipy.optimize import linear_sum_assignment

import partwright as pw
from partwright.approximation.separation import subtracted_names
from partwright.atomic_io import write_bytes
from partwright.meshing import mesh_assembly

NEAR, RIGHT = 0.05, 0.01
WANTED = (0.90, 0.97)  # of features, of numbers


@dataclass(frozen=True)
class Row:
    """A part. numbers: of the features that were found; right: of those."""

    number: int
    family: str
    features: int
    found: int
    numbers: int
    right: int
    further: int
    iou: float
    seconds: float
    missed: str


def hits(feature: Feature, part: pw.Part, within: float) -> int:
    """How many numbers of the feature one copy of a part has."""
    low, high = feature.part.copies[0].bounds()
    spans = dict(zip("xyz", (high - low).tolist(), strict=True))

    def has(number: Number, own: Sequence[Number]) -> bool:
        kind, value = number
        reach = within * (spans.get(kind, value))
        return any(k == kind and abs(v - value) <= reach for k, v in own)

    best = 0
    for copy in part.copies:
        own = numbers(copy)
        best = max(best, sum(has(number, own) for number in feature.numbers))
    return best


def compared(drawn: Drawn, found: pw.Assembly) -> tuple[list[tuple[Feature, pw.Part | None]], int]:
    """Each feature with the part that stands for it, if there is one, and how many parts stand for none."""
    cut = subtracted_names(found)
    shares = np.zeros((len(drawn.features), len(found.parts)))
    for i, feature in enumerate(drawn.features):
        for j, part in enumerate(found.parts):
            alike = feature.added is (part.name not in cut) and len(part.copies) == len(feature.part.copies)
            share = hits(feature, part, NEAR) / len(feature.numbers) if alike else 0.0
            shares[i, j] = share if share >= 0.5 else 0.0
    pairs = {i: j for i, j in zip(*linear_sum_assignment(-shares), strict=True) if shares[i, j] > 0}
    matched = [(f, found.parts[pairs[i]] if i in pairs else None) for i, f in enumerate(drawn.features)]
    return matched, len(found.parts) - len(pairs)


def measured(number: int, drawn: Drawn, quality: str) -> Row:
    shape = pw.load_shape(mesh_assembly(drawn.assembly, 128), unit="mm")
    started = time.process_time()
    result = pw.fit(shape, "solids", quality=quality)
    matched, further = compared(drawn, result.assembly)
    found = [(feature, part) for feature, part in matched if part is not None]
    return Row(
        number,
        drawn.family,
        len(matched),
        len(found),
        sum(len(feature.numbers) for feature, _ in found),
        sum(hits(feature, part, RIGHT) for feature, part in found),
        further,
        result.scores.iou,
        time.process_time() - started,
        ", ".join(feature.part.name for feature, part in matched if part is None),
    )


def line(name: str, rows: Sequence[Row]) -> str:
    features, found = (sum(getattr(row, key) for row in rows) for key in ("features", "found"))
    total, right = (sum(getattr(row, key) for row in rows) for key in ("numbers", "right"))
    whole = sum(row.found == row.features and not row.further for row in rows)
    cells = [name, str(len(rows)), f"{found} of {features} ({100 * found / features:.0f} %)"]
    cells += [f"{right} of {total} ({100 * right / max(total, 1):.0f} %)", str(whole)]
    cells += [f"{np.mean([row.further for row in rows]):.1f}", f"{np.mean([row.iou for row in rows]):.4f}"]
    return f"| {' | '.join(cells)} | {np.mean([row.seconds for row in rows]):.1f} |"


def table(rows: Sequence[Row], command: str, quality: str) -> str:
    found = sum(row.found for row in rows) / sum(row.features for row in rows)
    right = sum(row.right for row in rows) / max(1, sum(row.numbers for row in rows))
    reached = "reached" if found >= WANTED[0] and right >= WANTED[1] else "not reached"
    families = [[row for row in rows if row.family == family.__name__] for family in (*FAMILIES, moulding)]
    return "\n".join(
        [
            "# Parts of known features, found again",
            "",
            f"`{command}` on {machine()}, quality {quality}.",
            "",
            f"Wanted: {100 * WANTED[0]:.0f} % of features found exactly, "
            f"{100 * WANTED[1]:.0f} % of their numbers to 1 %: {reached}.",
            "",
            "| family | parts | features found exactly | numbers to 1 % | nothing missed, nothing more "
            "| further parts | IoU | CPU s |",
            "|---|---:|---:|---:|---:|---:|---:|---:|",
            *(line(own[0].family, own) for own in families if own),
            line("all", rows),
            "",
            "Not found, or in pieces:",
            "",
            *(
                f"- {row.family} {row.number}: {row.missed or 'nothing'}; {row.further} further parts"
                for row in rows
                if row.missed or row.further
            ),
            "",
        ]
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--count", type=int, default=100, help="parts, a quarter of each family, and as many mouldings"
    )
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results/known_features.md")
    options = parser.parse_args()
    rows = []
    parts = [(number, drawn_part(number)) for number in range(options.count)]
    parts += [(number, drawn_moulding(number)) for number in range(options.count // len(FAMILIES))]
    for number, drawn in parts:
        rows.append(measured(number, drawn, options.quality))
        shown = replace(rows[-1], seconds=round(rows[-1].seconds, 1), iou=round(rows[-1].iou, 4))
        print(shown, flush=True)
    command = f"python benchmarks/known_features.py --count {options.count}"
    command += "" if options.quality == "draft" else f" --quality {options.quality}"
    write_bytes(options.output, table(rows, command, options.quality).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
