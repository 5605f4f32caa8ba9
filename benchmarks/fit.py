"""How good, how fast and how large `partwright fit` is, on every shape of one or several sets.

    python benchmarks/fit.py --shapes FOLDER --sets toys,cad --seeds 0,1,2
    python benchmarks/fit.py --shapes FOLDER --sets toys,cad --every 5 --quality normal,high --tag high

Each shape is fitted as a user would: a process of its own, default settings, all files read and written. So
the seconds contain the start of Python, and the peak memory is that of the whole process. FOLDER holds an
index.json (a list of {"name", "set", "file"}), or just meshes; without it, the project's own shapes are
taken. Of several qualities each is told beside the first, shape after shape in the same run. The table goes
to benchmarks/results/fit.md, every single run to the CSV file beside it; both are brought up to date after
each shape.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from pathlib import Path

import recorded
from fit_page import COLUMNS, SCORES, Run, document, of_quality, over_seeds, table, worst

from partwright.atomic_io import write_bytes

HERE = Path(__file__).parent
OWN_SHAPES = HERE.parent / "examples" / "shapes"
MESHES = {".obj", ".ply", ".stl", ".off", ".glb", ".gltf", ".3mf", ".step", ".stp"}


@dataclass(frozen=True)
class Entry:
    """A shape to fit."""

    set: str
    name: str
    path: Path
    options: tuple[str, ...] = ()
    """Passed on to partwright fit, for this shape alone."""
    source: str = ""
    """Where it was published, where the index says so."""


def find_shapes(folder: Path, sets: set[str], names: set[str]) -> list[Entry]:
    """The shapes of a folder, by its index if it has one; only those of the sets and names, if any are given.

    Raises:
        SystemExit: there are none, or a set or name does not occur.
    """
    index = folder / "index.json"
    if index.is_file():
        listed = json.loads(index.read_text(encoding="utf-8"))
        entries = [
            Entry(item["set"], item["name"], folder / item["file"], source=item.get("source", ""))
            for item in listed
        ]
    else:
        meshes = sorted(p for p in folder.rglob("*") if p.suffix.lower() in MESHES)
        entries = [Entry(p.parent.name, p.stem, p) for p in meshes]
    for kind, wanted in (("set", sets), ("name", names)):
        missing = wanted - {getattr(entry, kind) for entry in entries}
        if missing:
            raise SystemExit(f"{folder} holds no {kind} called {', '.join(sorted(missing))}")
    chosen = [e for e in entries if (not sets or e.set in sets) and (not names or e.name in names)]
    if not chosen:
        raise SystemExit(f"{folder} holds no shapes: expected an index.json or {', '.join(sorted(MESHES))}")
    return chosen


def fit_once(entry: Entry, seed: int, options: list[str], keep: Path | None = None) -> Run:
    """One fit in a process of its own; its files stay in the folder `keep`, if given."""
    with tempfile.TemporaryDirectory() as folder:
        out, log = keep or Path(folder) / "out", Path(folder) / "log"
        command = [sys.executable, "-m", "partwright", "fit", str(entry.path), "-o", str(out)]
        with log.open("wb") as stream:
            start = time.perf_counter()
            process = subprocess.Popen(
                [*command, "--seed", str(seed), *options, *entry.options],
                stdout=stream,
                stderr=subprocess.STDOUT,
                # As on most machines: Python keeps what it compiles, which else is a quarter of a fit.
                env=os.environ | {"PYTHONDONTWRITEBYTECODE": ""},
            )
            _, status, usage = os.wait4(process.pid, 0)
            seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        cost = {"seconds": seconds, "peak_mb": usage.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)}
        cost |= {"cpu_seconds": usage.ru_utime + usage.ru_stime}
        if process.returncode != 0:
            lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["no message"]
            message = lines[-1].replace(str(entry.path), entry.path.name)
            failure = f"failed ({process.returncode}): {message}"
            return Run(entry.set, entry.name, seed, failure, **cost)
        report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    scores = report["scores"]
    measured = {name: scores[name] for name in SCORES if name in scores}
    measured |= {name: report[name] for name in ("parts", "instances")}
    measured |= {name: 100 * scores[f"max_{name}_share"] for name in ("deviation", "protrusion")}
    return Run(entry.set, entry.name, seed, report["outcome"], **measured, **cost)


def machine() -> str:
    """Cores and widest instruction set, as far as the kernel has code for it."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    info = Path("/proc/cpuinfo")
    flags = set(info.read_text().split()) if info.is_file() else set()
    level = "-v4" if "avx512f" in flags else "-v3" if "avx2" in flags else ""
    return f"{cores} cores, {platform.machine()}{level}"


def _by_set(entries: list[Entry]) -> list[list[Entry]]:
    return [[one for one in entries if one.set == name] for name in dict.fromkeys(one.set for one in entries)]


def measure(
    entries: list[Entry], seeds: list[int], options: list[str], jobs: int
) -> Iterator[tuple[Entry, Run]]:
    """All runs as they end, `jobs` at a time. After an interruption the running ones end first."""
    todo = [(entry, seed) for entry in entries for seed in seeds]
    pending: dict[Future[Run], Entry] = {}
    with ThreadPoolExecutor(jobs) as pool:
        while todo or pending:
            while todo and len(pending) < jobs:
                entry, seed = todo.pop(0)
                pending[pool.submit(fit_once, entry, seed, options)] = entry
            ended, _ = wait(pending, return_when=FIRST_COMPLETED)
            yield from ((pending.pop(future), future.result()) for future in ended)


def main() -> int:
    options = parser().parse_args()
    names, sets = ({*filter(None, text.split(","))} for text in (options.names, options.sets))
    seeds = [int(seed) for seed in options.seeds.split(",")]
    entries = find_shapes(options.shapes, sets, names)
    qualities = [*filter(None, options.quality.split(","))]
    if unknown := set(qualities) - {"draft", "normal", "high"}:
        raise SystemExit(f"--quality: no quality is called {', '.join(sorted(unknown))}")
    if options.every > 1:
        entries = [one for of in _by_set(entries) for one in of[:: options.every]]
    if len(qualities) > 1:
        entries = [
            replace(one, set=one.set + of_quality(quality), options=("--quality", quality))
            for one in entries
            for quality in qualities
        ]
    passed = ["--quality", *qualities] if len(qualities) == 1 else []
    passed += ["--max-parts", str(options.max_parts)] if options.max_parts else []
    target = HERE / "results" / (f"fit-{options.tag}.md" if options.tag else "fit.md")
    target.parent.mkdir(exist_ok=True)
    made = f"`{_command(options)}` on {machine()}"
    runs: dict[Entry, list[Run]] = {entry: [] for entry in entries}
    interrupted = False
    try:
        for count, (entry, run) in enumerate(measure(entries, seeds, passed, options.jobs), 1):
            runs[entry].append(replace(run, seconds=None) if options.untimed else run)
            print(f"{count}/{len(entries) * len(seeds)} {_line(run)}", flush=True)
            finished = [of for of in runs.values() if len(of) == len(seeds)]
            text = document(finished, made, seeds, len(entries), qualities)
            write_bytes(target, text.encode())
            write_bytes(
                target.with_suffix(".csv"), recorded.text(r for of in runs.values() for r in of).encode()
            )
    except KeyboardInterrupt:
        interrupted = True
    finished = [over_seeds(of) for of in runs.values() if len(of) == len(seeds)]
    print("", *table(finished), "", *worst(finished), sep="\n")
    print(
        f"{'interrupted; ' if interrupted else ''}written to {target} and {target.with_suffix('.csv').name}"
    )
    return 130 if interrupted else int(any(run.iou is None for run in finished))


def _line(run: Run) -> str:
    cells = (f"{header} {cell(run)}" for header, cell in COLUMNS.items() if header != "floor")
    return f"{run.set}/{run.name} seed {run.seed}: {', '.join(cells)}"


def _command(options: argparse.Namespace) -> str:
    """What to type to get this table; of the folder of shapes only its name, wherever it lies."""
    given = {"--shapes": options.shapes.name if options.shapes != OWN_SHAPES else ""}
    given |= {"--sets": options.sets, "--names": options.names, "--quality": options.quality}
    given |= {"--max-parts": options.max_parts, "--jobs": options.jobs if options.jobs > 1 else ""}
    given |= {"--seeds": options.seeds if options.seeds != "0" else ""}
    given |= {"--every": options.every if options.every > 1 else ""}
    flags = ["--untimed"] if options.untimed else []
    return " ".join(["python benchmarks/fit.py", *(f"{k} {v}" for k, v in given.items() if v), *flags])


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--sets", default="", metavar="A,B", help="only these sets")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--seeds", default="0", metavar="0,1,2", help="the median over these counts")
    option(
        "--quality",
        default="",
        metavar="Q,R",
        help="draft, normal or high; of several, each beside the first",
    )
    option("--every", type=int, default=1, metavar="N", help="of each set only its first shape and every Nth")
    option("--max-parts", type=int, metavar="N", help="passed on to partwright fit")
    option("--tag", default="", help="writes fit-TAG.md")
    option(
        "--untimed", action="store_true", help="leaves out all but CPU seconds: for a machine that is busy"
    )
    option(
        "--jobs", type=int, default=1, metavar="N", help="fits at a time: more are faster but time nothing"
    )
    return result


if __name__ == "__main__":
    sys.exit(main())
