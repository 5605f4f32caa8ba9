"""Shapes an hour: fits one after another, and several at once, on the CPU or an accelerator.

    python benchmarks/throughput.py --shapes FOLDER [--names mug,bunny] [--device cuda] [--at-once 1,2,4]

Times `partwright.fit_many`, the start of its worker processes included, shapes loaded before. One at a time
has all cores to itself; the latency of one shape is its seconds. Assemblies have to be the same whatever the
number at once. FOLDER is as for fit.py; twelve of its shapes are taken where it has them. The table goes to
benchmarks/results/throughput.md (throughput_cuda.md with --device cuda).
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

from ablations import NAMES
from fit import OWN_SHAPES, find_shapes, machine

import partwright as pw
from partwright.assembly.file_text import to_text
from partwright.atomic_io import write_bytes
from partwright.fitting import Result

RESULTS = Path(__file__).parent / "results"
HEAD = "| at once | seconds | seconds a shape | shapes an hour | x one at a time | mean IoU | parts |"


def fitted(shapes: list[pw.Shape], at_once: int, device: str) -> tuple[float, list[Result]]:
    start = time.perf_counter()
    found = pw.fit_many(shapes, at_once=at_once, device=device)
    seconds = time.perf_counter() - start
    failed = [one for one in found if not isinstance(one, Result)]
    if failed:
        raise SystemExit(f"a fit failed: {failed[0]}")
    return seconds, [one for one in found if isinstance(one, Result)]


def row(at_once: int, seconds: float, first: float, results: list[Result]) -> str:
    count = len(results)
    iou = sum(one.scores.iou for one in results) / count
    parts = sum(one.scores.parts for one in results) / count
    return (
        f"| {at_once} | {seconds:.1f} | {seconds / count:.2f} | {3600 * count / seconds:.0f} "
        f"| {first / seconds:.2f} | {iou:.4f} | {parts:.1f} |"
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, default=OWN_SHAPES)
    parser.add_argument("--names", default=",".join(NAMES))
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--at-once", default=f"1,{os.cpu_count() or 1}", help="the first is compared with")
    given = parser.parse_args()
    every = find_shapes(given.shapes, set(), set())
    entries = [one for one in every if one.name in given.names.split(",")] or every
    shapes = [pw.load_shape(one.path) for one in entries]
    pw.fit(shapes[0], quality="draft", device=given.device)  # imports, and the device's start
    rows, first, before = [], 0.0, None
    for at_once in map(int, given.at_once.split(",")):
        seconds, results = fitted(shapes, at_once, given.device)
        made = [to_text(one.assembly) for one in results]
        if before is not None and made != before:
            print(f"assemblies differ with {at_once} at once", file=sys.stderr)
            return 1
        first, before = first or seconds, made
        rows.append(row(at_once, seconds, first, results))
        print(rows[-1], flush=True)
    command = " ".join(["python benchmarks/throughput.py", *sys.argv[1:]])
    lines = [
        "# Shapes an hour",
        "",
        f"`{command}` on {machine()}: {len(shapes)} shapes, default settings, scores included;",
        "wall-clock seconds.",
        "",
        HEAD,
        "|" + "---:|" * (HEAD.count("|") - 1),
        *rows,
    ]
    name = "throughput_cuda.md" if given.device == "cuda" else "throughput.md"
    write_bytes(RESULTS / name, ("\n".join(lines) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
