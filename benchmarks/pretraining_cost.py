"""What pre-training CAPRI-Net's network as published would take on one core.

    python benchmarks/pretraining_cost.py

One shape of 24,576 points is trained on for a few steps at either size of the network, and the seconds of the
processor that a step takes more are multiplied: the paper takes 1,000 epochs of 5,000 shapes (section 4.1),
and products of matrices as large take as long for each shape of a batch.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import torch
from fit import machine

from partwright.atomic_io import write_bytes
from partwright.capri.network import SIZES
from partwright.capri.pretraining import PretrainingSettings, train

_POINTS = 24_576  # of a shape (section 4.1)
_PASSES = 5_000 * 1_000  # shapes times epochs
_DAY = 86_400
_PAPER = 9 / 24  # days that it took there, on a GTX 1080Ti


def seconds(size: str, steps: int) -> float:
    """Of the processor, for so many steps of one shape, its making and what is read and written included."""
    settings = PretrainingSettings(parts=1, points=_POINTS, batch=1, draw=_POINTS, steps=steps)
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        train(Path(folder), settings, SIZES[size], device="cpu")
        return time.process_time() - start


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--steps", type=int, default=6, help="that are timed")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path(__file__).parent / "results" / "pretraining_cost.md"
    )
    options = parser.parse_args()
    torch.set_num_threads(1)
    lines = [
        "# What pre-training the network as published would take",
        "",
        f"`python benchmarks/pretraining_cost.py` on {machine()}, one thread; seconds are of the processor.",
        "",
        f"5,000 shapes, 1,000 epochs, {_POINTS:,} points a shape (section 4.1): {_PASSES:,} shapes to pass. "
        f"The paper took {_PAPER:.2f} days on a GTX 1080Ti.",
        "",
        "| network | s a shape | days of one core |",
        "|---|---:|---:|",
    ]
    for size in sorted(SIZES, reverse=True):
        each = (seconds(size, 1 + options.steps) - seconds(size, 1)) / options.steps
        days = each * _PASSES / _DAY
        lines.append(f"| {size} | {each:.2f} | {days:,.0f} |")
        print(lines[-1], flush=True)
    write_bytes(options.output, ("\n".join(lines) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
