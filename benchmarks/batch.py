"""`partwright batch` on many small shapes: how many an hour, and what is left of a run that is killed.

    python benchmarks/batch.py [--shapes 200] [--kills 20] [--work FOLDER] [--output FILE.md]

Makes the shapes, fits them undisturbed by one worker (a part of them) and by one a core, then once more while
the batch or one of its workers, by turns, is killed with SIGKILL at random moments; then compares the files.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import resource
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


def timed(words: list[str]) -> tuple[float, float]:
    """Seconds on the clock, and of all processors."""
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(words, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, spent


def killed(words: list[str], manifest: Path, moments: list[float]) -> tuple[float, int, int]:
    """Runs the command until it ends by itself; seconds, how many runs that took, and how many kills.

    moments: numbers of finished shapes, in order. After each of them, and up to two seconds more, the batch
    or a worker is killed, by turns.
    """
    generator, left = random.Random(0), list(moments)
    start, runs = time.perf_counter(), 0
    while True:
        runs += 1
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while left and process.poll() is None:
            time.sleep(0.1)
            if not manifest.exists() or manifest.read_bytes().count(b"\n") < left[0]:
                continue
            time.sleep(generator.uniform(0.0, 2.0))
            workers = psutil.Process(process.pid).children() if process.poll() is None else []
            if len(left) % 2 and workers:
                generator.choice(workers).kill()
                left.pop(0)
            elif workers:  # it is at work
                process.send_signal(signal.SIGKILL)
                left.pop(0)
                break
        if process.wait() == 0:
            return time.perf_counter() - start, runs, len(moments) - len(left)


def digests(out: Path) -> dict[str, str]:
    """Of every file that a fit writes and that holds no times."""
    files = [p for p in sorted(out.glob("items/*/*/*")) if p.name != "report.json"]
    return {p.relative_to(out).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def _once(place: Path, name: str, *more: str) -> tuple[float, float]:
    """Seconds of an undisturbed run as `timed` tells them, or what they were."""
    file = place / f"{name}.json"
    if not file.exists():
        file.write_text(json.dumps(timed(command(place / "in", place / name, *more))))
    clock, processors = json.loads(file.read_text())
    return clock, processors


def _written(out: Path) -> int:
    """Bytes of all items."""
    return sum(file.stat().st_size for file in out.glob("items/*/*/*"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", type=int, default=200)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--output", type=Path)
    parser.add_argument(
        "--work", type=Path, help="a folder that is kept: what is whole in it is not fitted again"
    )
    arguments = parser.parse_args()
    cores = os.cpu_count() or 1
    with tempfile.TemporaryDirectory() as folder:
        place = arguments.work or Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        if not (place / "in").exists():
            make(place / "in", arguments.shapes)
        alone, spent = _once(place, "alone", "--at-once", "1", "--limit", str(_ALONE))
        whole, _ = _once(place, "whole")
        moments = np.sort(np.random.default_rng(1).uniform(0, arguments.shapes - 2, arguments.kills))
        manifest = place / "killed" / "manifest.jsonl"
        again, runs, kills = killed(command(place / "in", manifest.parent), manifest, moments.tolist())
        lines = list(entries(manifest))
        done = Counter(entry.item for entry in lines if entry.status == DONE)
        first, second = digests(place / "whole"), digests(place / "killed")
        peak = max(entry.peak_memory for entry in lines)
        rows = {
            "shapes": arguments.shapes,
            f"shapes an hour, 1 worker (of {cores} cores)": f"{3600 * _ALONE / alone:.0f}",
            f"shapes an hour, {cores} workers": f"{3600 * arguments.shapes / whole:.0f}",
            "CPU seconds a shape, start and all": f"{spent / _ALONE:.2f}",
            "kB a shape that are written": f"{_written(place / 'whole') / arguments.shapes / 1000:.0f}",
            "largest memory of a worker": f"{peak / 1e6:.0f} MB",
            "SIGKILL, of the batch and of a worker by turns": kills,
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
