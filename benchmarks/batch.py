"""`partwright batch` on many small shapes: how many an hour, and what is left of a run that is killed.

    python benchmarks/batch.py [--shapes 200] [--kills 20] [--output benchmarks/results/batch.md]

Makes the shapes, fits them undisturbed by one worker (a part of them) and by one a core, then once more while
the batch or one of its workers, by turns, is killed with SIGKILL at random moments; then compares the files.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import psutil
import trimesh
from fit import machine

from partwright.batch.manifest import DONE, entries

_ALONE = 20  # shapes that one worker fits, for the ratio


def make(folder: Path, count: int) -> None:
    """Boxes, cylinders, tubes and small unions, no two alike."""
    folder.mkdir()
    rng = np.random.default_rng(0)
    for i in range(count):
        body = trimesh.creation.box(rng.uniform(0.4, 1.0, 3))
        knob = trimesh.creation.cylinder(rng.uniform(0.1, 0.3), rng.uniform(1.0, 1.6), sections=24)
        ring = trimesh.creation.annulus(rng.uniform(0.2, 0.4), 0.6, rng.uniform(0.3, 0.8), sections=24)
        shape = (body, knob, ring, trimesh.boolean.union([body, knob], engine="manifold"))[i % 4]
        shape.export(folder / f"s{i:03d}.stl")


def command(source: Path, out: Path, *more: str) -> list[str]:
    return [
        sys.executable,
        "-m",
        "partwright",
        "batch",
        str(source),
        "-o",
        str(out),
        "--quality",
        "draft",
        *more,
    ]


def timed(words: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(words, check=True, capture_output=True)
    return time.perf_counter() - start


def killed(words: list[str], times: int, apart: float) -> tuple[float, int]:
    """Runs the command until it ends by itself; seconds, and how many runs that took.

    The moments are ``apart`` seconds from one another on average, and at least 4, which a start takes.
    """
    apart = max(apart, 8.0)
    generator = random.Random(0)
    start, runs, left = time.perf_counter(), 0, times
    while True:
        runs += 1
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while left:
            try:
                process.wait(generator.uniform(4.0, 2.0 * apart - 4.0))
                break
            except subprocess.TimeoutExpired:
                left -= 1
            if left % 2 and (workers := psutil.Process(process.pid).children()):
                generator.choice(workers).kill()
                continue
            process.send_signal(signal.SIGKILL)
            break
        if process.wait() == 0:
            return time.perf_counter() - start, runs


def digests(out: Path) -> dict[str, str]:
    """Of every file that a fit writes and that holds no times."""
    files = [p for p in sorted(out.glob("items/*/*/*")) if p.name != "report.json"]
    return {p.relative_to(out).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", type=int, default=200)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--output", type=Path)
    arguments = parser.parse_args()
    cores = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        make(place / "in", arguments.shapes)
        alone = timed(command(place / "in", place / "alone", "--at-once", "1", "--limit", str(_ALONE)))
        whole = timed(command(place / "in", place / "whole"))
        again, runs = killed(
            command(place / "in", place / "killed"), arguments.kills, whole / (arguments.kills + 1)
        )
        lines = list(entries(place / "killed" / "manifest.jsonl"))
        done = Counter(entry.item for entry in lines if entry.status == DONE)
        first, second = digests(place / "whole"), digests(place / "killed")
        peak = max(entry.peak_memory for entry in lines)
        rows = {
            "shapes": arguments.shapes,
            f"shapes an hour, 1 worker (of {cores} cores)": f"{3600 * _ALONE / alone:.0f}",
            f"shapes an hour, {cores} workers": f"{3600 * arguments.shapes / whole:.0f}",
            "largest memory of a worker": f"{peak / 1e6:.0f} MB",
            "SIGKILL, of the batch and of a worker by turns": arguments.kills,
            "runs until the end": runs,
            "seconds, killed against undisturbed": f"{again / whole:.2f}",
            "items without a result": arguments.shapes - len(done),
            "items done twice": sum(count > 1 for count in done.values()),
            "files that differ from the undisturbed run": len(first.items() ^ second.items()),
        }
    table = ["| | |", "|---|---:|", *(f"| {name} | {value} |" for name, value in rows.items())]
    told = f"`python benchmarks/batch.py --shapes {arguments.shapes} --kills {arguments.kills}`, {machine()}."
    text = "\n".join(["# A folder of shapes", "", told, "Draft quality.", "", *table, ""])
    print(text)
    if arguments.output:
        arguments.output.write_text(text)


if __name__ == "__main__":
    main()
