"""Fits by features before and after cleaning: how long their numbers are, what holds, and what it costs.

    python benchmarks/solids.py --shapes FOLDER --sets cad --variants solids --fits FITS
    python benchmarks/cleaned_features.py --shapes FOLDER --sets cad --fits FITS/solids

Each FITS/solids/NAME/assembly.json is cleaned against its shape at the default tolerance, half a thousandth
of the longest side. Digits are those of every length of the parts: corners, radii, heights and places.
"""

from __future__ import annotations

import sys
import time
from statistics import mean

import numpy as np
from fitted import command, fits, parser

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.cleaning.dimensions import values
from partwright.export.solid_source import number
from partwright.fields import Pipe, Solid, Swept


def digits(assembly: pw.Assembly) -> float:
    """Mean number of digits that a person would have to type."""
    lengths: list[float] = []
    for part in assembly.parts:
        lengths += part.translation
        if isinstance(part.field, Swept):
            lengths += [float(v) for v in part.field.profile.corners[:, :2].ravel()]
            lengths += [getattr(part.field, "height", 0.0)]
        elif isinstance(part.field, Pipe):
            lengths += [v for corner in part.field.path for v in corner]
            lengths += [part.field.radius, part.field.thickness]
        elif isinstance(part.field, Solid):
            lengths += values(part.field).tolist()
    return mean(len(number(abs(v)).replace(".", "").strip("0")) for v in lengths if v)


def main() -> int:
    options = parser(__doc__, "cleaned_features.md").parse_args()
    lines, changes, drifts = [], [], []
    for entry, path in fits(options):
        fitted, shape = pw.load_assembly(path), pw.load_shape(entry.path)
        started = time.process_time()
        cleaned = pw.clean(fitted, shape)
        seconds = time.process_time() - started
        longest = float(np.ptp(shape.vertices, axis=0).max())
        before, after = cleaned.before, cleaned.after
        off = [100 * one.mean_deviation / longest for one in (before, after)]
        changes.append(after.iou - before.iou)
        drifts.append(off[1] - off[0])
        cells = (
            entry.name,
            f"{len(cleaned.assembly)}",
            f"{digits(fitted):.1f} -> {digits(cleaned.assembly):.1f}",
            f"{len(cleaned.relations)}",
            f"{before.iou:.3f} -> {after.iou:.3f}",
            f"{off[0]:.3f} -> {off[1]:.3f}",
            f"{seconds:.1f}",
        )
        lines.append(f"| {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    head = [
        "# Fits by features, cleaned",
        "",
        command("cleaned_features.py", options),
        "",
        f"Mean change of IoU {mean(changes):+.4f}, of the mean deviation {mean(drifts):+.4f} % of the "
        f"longest side, over {len(lines)} shapes. Digits: of all lengths, the mean; off: mean deviation in % "
        "of the longest side; CPU seconds of cleaning and of both measurements.",
        "",
        "| shape | parts | digits | relations | IoU | off % | CPU s |",
        "|---|---:|---|---:|---|---|---:|",
    ]
    write_bytes(options.output, ("\n".join([*head, *lines]) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
