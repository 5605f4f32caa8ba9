"""What the leak through the intersection's relu does to fine-tuning from the pre-trained network.

    python benchmarks/finetuning_leak.py --shapes FOLDER --names A,B --seeds 0,1 --iterations 1200

The same shapes, seeds and iterations of each stage with and without; IoU is that of the pruned tree with the
shape, over uniform points. Rows are appended to benchmarks/results/finetuning_leak.csv as they end, and those
that are there are not made again.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import numpy as np
import recorded
import torch
from fit import Entry, find_shapes, machine

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.capri import layers, stages
from partwright.capri.finetuning import Finetuning, encoded
from partwright.capri.finetuning_samples import draw_finetuning_samples
from partwright.capri.paper import network_of
from partwright.capri.pruning import pruned
from partwright.capri.settings import Settings

RESULTS = Path(__file__).parent / "results"
LEAKING = layers.positive
POINTS = 100_000


@dataclass(frozen=True)
class Row:
    """One fine-tuning. leak: 1 where the gradient leaks."""

    name: str
    seed: int
    iterations: int
    leak: int
    iou: float
    convexes: int
    cpu_seconds: float


def run(entry: Entry, seed: int, iterations: int, leak: bool) -> Row:
    started = time.process_time()
    torch.set_num_threads(1)
    layers.positive = LEAKING if leak else torch.relu
    shape = pw.load_shape(entry.path)
    network = network_of(Settings(schedule="paper", start="weights"))
    samples = draw_finetuning_samples("samples", shape, seed)
    tuning = Finetuning(network, encoded(network, shape), samples, seed)
    for stage in stages.STAGES:
        tuning.run(stage, iterations, lambda share: None)
    points = np.random.default_rng(seed).uniform(-0.95, 0.95, (POINTS, 3))
    tree = pruned(tuning.tree(), points)
    found, inside = tree.occupancy(points), shape.unit_distance(points.astype(np.float32)) < 0
    iou = float((found & inside).sum() / max((found | inside).sum(), 1))
    return Row(entry.name, seed, iterations, int(leak), iou, tree.convexes, time.process_time() - started)


def document(rows: list[Row], command: str) -> str:
    lines = [
        "# A leak through the relu of the intersection, in fine-tuning from the pre-trained network",
        "",
        f"`{command}` on {machine()}, one thread.",
        "",
        "IoU of the pruned tree with the shape, over uniform points, without the leak and with it; convexes;",
        "iterations of each of the three stages.",
        "",
        "| shape | seed | iterations | IoU without | with | convexes without | with |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    pairs = list(_pairs(rows))
    for without, leaky in pairs:
        lines.append(
            f"| {leaky.name} | {leaky.seed} | {leaky.iterations} | {without.iou:.3f} | {leaky.iou:.3f} "
            f"| {without.convexes} | {leaky.convexes} |"
        )
    if pairs:
        before, after = (mean(pair[k].iou for pair in pairs) for k in (0, 1))
        ahead = sum(leaky.iou > without.iou for without, leaky in pairs)
        lines += [
            "",
            f"Mean {before:.3f} without, {after:.3f} with; {ahead} of {len(pairs)} are better with it.",
        ]
    return "\n".join(lines) + "\n"


def _pairs(rows: list[Row]) -> Iterator[tuple[Row, Row]]:
    found = {(row.name, row.seed, row.iterations, row.leak): row for row in rows}
    for name, seed, iterations, leak in found:
        if leak and (name, seed, iterations, 0) in found:
            yield found[name, seed, iterations, 0], found[name, seed, iterations, 1]


def main() -> int:
    options = parser().parse_args()
    path = options.output.with_suffix(".csv")
    names = {*filter(None, options.names.split(","))}
    command = (
        f"python benchmarks/finetuning_leak.py --shapes {options.shapes.name} --names {options.names} "
        f"--seeds {options.seeds} --iterations {options.iterations}"
    )
    for seed in map(int, options.seeds.split(",")):
        for entry in find_shapes(options.shapes, {"cad"}, names):
            for leak in (False, True):
                key = (entry.name, seed, options.iterations, int(leak))
                rows = recorded.read(path, Row)
                if any((row.name, row.seed, row.iterations, row.leak) == key for row in rows):
                    continue
                row = run(entry, seed, options.iterations, leak)
                recorded.append(path, row)
                print(row, flush=True)
    write_bytes(options.output, document(recorded.read(path, Row), command).encode())
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--seeds", default="0", metavar="A,B")
    option("--iterations", type=int, default=1200, metavar="N", help="of each stage (default: %(default)s)")
    option("-o", "--output", type=Path, default=RESULTS / "finetuning_leak.md", metavar="FILE")
    return result


if __name__ == "__main__":
    sys.exit(main())
