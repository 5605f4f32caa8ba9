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
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, fields, replace
from pathlib import Path
from statistics import mean, median

import recorded

from partwright.atomic_io import write_bytes

HERE = Path(__file__).parent
OWN_SHAPES = HERE.parent / "examples" / "shapes"
MESHES = {".obj", ".ply", ".stl", ".off", ".glb", ".gltf", ".3mf"}


@dataclass(frozen=True)
class Entry:
    """A shape to fit."""

    set: str
    name: str
    path: Path
    options: tuple[str, ...] = ()
    """Passed on to partwright fit, for this shape alone."""


@dataclass(frozen=True)
class Run:
    """One fit. deviation: the largest, protrusion: that of the assembly alone, in % of the longest side.

    Scores are None where the fit failed.
    """

    set: str
    name: str
    seed: int | str
    outcome: str
    iou: float | None = None
    bi_surface_iou: float | None = None
    chamfer: float | None = None
    chamfer_floor: float | None = None
    parts: float | None = None
    instances: float | None = None
    overlap: float | None = None
    deviation: float | None = None
    protrusion: float | None = None
    seconds: float | None = None
    peak_mb: float = 0.0
    cpu_seconds: float | None = None


NUMBERS = tuple(f.name for f in fields(Run))[4:]
SCORES = NUMBERS[:-3]
SECONDS = ("seconds", "cpu_seconds")

# header -> how the cell is made
COLUMNS: dict[str, Callable[[Run], str]] = {
    "IoU": lambda r: _number(r.iou, 4),
    "bi-surface IoU": lambda r: _number(r.bi_surface_iou, 4),
    "Chamfer x1e3": lambda r: _number(r.chamfer, 3, 1e3),
    "floor": lambda r: _number(r.chamfer_floor, 3, 1e3),
    "parts": lambda r: _number(r.parts, 1).removesuffix(".0"),
    "instances": lambda r: _number(r.instances, 1).removesuffix(".0"),
    "overlap": lambda r: _number(r.overlap, 3),
    "max deviation %": lambda r: _number(r.deviation, 2),
    "sticks out %": lambda r: _number(r.protrusion, 2),
    "seconds": lambda r: _number(r.seconds, 1),
    "CPU seconds": lambda r: _number(r.cpu_seconds, 1),
    "peak MB": lambda r: _number(r.peak_mb, 0),
    "outcome": lambda r: r.outcome,
}


def _number(value: float | None, digits: int, factor: float = 1.0) -> str:
    return "-" if value is None else f"{value * factor:.{digits}f}"


def find_shapes(folder: Path, sets: set[str], names: set[str]) -> list[Entry]:
    """The shapes of a folder, by its index if it has one; only those of the sets and names, if any are given.

    Raises:
        SystemExit: there are none, or a set or name does not occur.
    """
    index = folder / "index.json"
    if index.is_file():
        listed = json.loads(index.read_text(encoding="utf-8"))
        entries = [Entry(item["set"], item["name"], folder / item["file"]) for item in listed]
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


def over_seeds(runs: list[Run]) -> Run:
    """The median of every number over the seeds of one shape; a failure of any seed shows."""
    failed = [run for run in runs if run.iou is None]
    if failed:
        return failed[0]
    outcomes = ", ".join(dict.fromkeys(run.outcome for run in runs))
    untimed = {name for name in SECONDS for run in runs if getattr(run, name) is None}
    medians = {name: median(getattr(run, name) for run in runs) for name in NUMBERS if name not in untimed}
    return Run(runs[0].set, runs[0].name, "median", outcomes, **medians)


def summary(rows: list[Run]) -> Run:
    """Means of a set, medians of the seconds, the largest peak; failures are counted and left out."""
    good = [row for row in rows if row.iou is not None]
    failures = f"{len(rows) - len(good)} failed" if len(good) < len(rows) else ""
    total = Run(rows[0].set, f"mean of {len(good)}", "", failures)
    if not good:
        return total
    means = {name: mean(getattr(row, name) for row in good) for name in SCORES}
    spent = {name: [value for row in good if (value := getattr(row, name)) is not None] for name in SECONDS}
    return replace(
        total,
        **means,
        **{name: median(seconds) if seconds else None for name, seconds in spent.items()},
        peak_mb=max(row.peak_mb for row in good),
    )


def table(rows: list[Run]) -> Iterator[str]:
    """Markdown: a row a shape, and under each set its summary in bold."""
    yield f"| shape | {' | '.join(COLUMNS)} |"
    yield "|---|" + "---:|" * (len(COLUMNS) - 1) + "---|"
    for name in dict.fromkeys(row.set for row in rows):
        members = [row for row in rows if row.set == name]
        for row in members:
            yield f"| {row.name} | {' | '.join(cell(row).replace('|', '/') for cell in COLUMNS.values())} |"
        total = summary(members)
        cells = " | ".join(f"**{cell(total)}**" if cell(total) else "" for cell in COLUMNS.values())
        yield f"| **{name}: {total.name}** | {cells} |"


def apart(runs: list[list[Run]]) -> Iterator[str]:
    """Markdown: how far the seeds of a shape are apart (largest less smallest), a row a set."""
    yield "| over the seeds | IoU, mean | IoU, most | parts, mean | parts, most | by over 2 and a tenth |"
    yield "|---|---:|---:|---:|---:|---:|"
    for name in dict.fromkeys(of[0].set for of in runs):
        members = [of for of in runs if of[0].set == name and all(run.iou is not None for run in of)]
        if not members:
            continue
        ious, parts = ([_range(of, number) for of in members] for number in ("iou", "parts"))
        many = [of for of, wide in zip(members, parts, strict=True) if wide > max(2.0, 0.1 * _most(of))]
        iou_at, parts_at = (members[wide.index(max(wide))][0].name for wide in (ious, parts))
        yield (
            f"| {name} | {mean(ious):.4f} | {max(ious):.4f} ({iou_at}) | {mean(parts):.1f} "
            f"| {max(parts):g} ({parts_at}) | {len(many)} of {len(members)} |"
        )


def _range(runs: list[Run], number: str) -> float:
    values = [getattr(run, number) for run in runs]
    return max(values) - min(values)


def _most(runs: list[Run]) -> float:
    return max(run.parts or 0.0 for run in runs)


def beside(rows: list[Run], qualities: list[str]) -> Iterator[str]:
    """Markdown: what each further quality has for the first one's parts and seconds, a row a set."""
    first, *others = qualities
    yield f"| beside {first} | IoU | bi-surface IoU | parts, times | seconds, times | CPU seconds, times |"
    yield "|---|---:|---:|---:|---:|---:|"
    of = {(row.set, row.name): row for row in rows if row.iou is not None}
    for name in dict.fromkeys(
        row.set.removesuffix(_of(first)) for row in rows if row.set.endswith(_of(first))
    ):
        for quality in others:
            pairs = [
                (row, of[name + _of(quality), shape])
                for (group, shape), row in of.items()
                if group == name + _of(first) and (name + _of(quality), shape) in of
            ]
            if pairs:
                iou, surface = (
                    mean(getattr(b, score) - getattr(a, score) for a, b in pairs)
                    for score in ("iou", "bi_surface_iou")
                )
                parts = sum(b.parts or 0 for _, b in pairs) / sum(a.parts or 0 for a, _ in pairs)
                times = (_number(_times(pairs, number), 2) for number in SECONDS)
                cells = [f"{iou:+.4f}", f"{surface:+.4f}", f"{parts:.2f}", *times]
                yield f"| {name}{_of(quality)} | {' | '.join(cells)} |"


def _of(quality: str) -> str:
    return f", {quality}"


def _times(pairs: list[tuple[Run, Run]], number: str) -> float | None:
    """The median over pairs of the second's seconds for the first's."""
    if any(getattr(run, number) is None for pair in pairs for run in pair):
        return None
    return median(getattr(b, number) / getattr(a, number) for a, b in pairs)


def worst(rows: list[Run]) -> Iterator[str]:
    """A sentence a set on the shape with the lowest IoU."""
    for name in dict.fromkeys(row.set for row in rows):
        members = [row for row in rows if row.set == name and row.iou is not None]
        if members:
            low = min(members, key=lambda row: row.iou or 0.0)
            yield f"Worst of {name}: {low.name}, IoU {low.iou:.4f} with {low.parts:g} parts."


def machine() -> str:
    """Cores and widest instruction set, as far as the kernel has code for it."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    info = Path("/proc/cpuinfo")
    flags = set(info.read_text().split()) if info.is_file() else set()
    level = "-v4" if "avx512f" in flags else "-v3" if "avx2" in flags else ""
    return f"{cores} cores, {platform.machine()}{level}"


def document(
    runs: list[list[Run]], command: str, seeds: list[int], planned: int, qualities: list[str]
) -> str:
    """The whole page, of the shapes (S, seeds) that are done."""
    rows = [over_seeds(of) for of in runs]
    done = "" if len(rows) == planned else f" Unfinished: {len(rows)} of {planned} shapes."
    lines = [
        "# `partwright fit`, shape by shape",
        "",
        f"`{command}` on {machine()}.{done}",
        "",
        f"Median over seeds {', '.join(map(str, seeds))}." if len(seeds) > 1 else f"Seed {seeds[0]}.",
        "Rows in bold are means, but for the median of the seconds and the largest peak. Seconds and peak",
        "memory are those of a whole process, files read and written. Chamfer's floor is that of two samples",
        "of the shape itself; deviations are in % of the longest side.",
        "",
        *table(rows),
        "",
        *([*apart(runs), ""] if len(seeds) > 1 else []),
        *([*beside(rows, qualities), ""] if len(qualities) > 1 else []),
        *worst(rows),
    ]
    return "\n".join(lines) + "\n"


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
            replace(one, set=one.set + _of(quality), options=("--quality", quality))
            for one in entries
            for quality in qualities
        ]
    passed = ["--quality", *qualities] if len(qualities) == 1 else []
    passed += ["--max-parts", str(options.max_parts)] if options.max_parts else []
    target = HERE / "results" / (f"fit-{options.tag}.md" if options.tag else "fit.md")
    target.parent.mkdir(exist_ok=True)
    runs: dict[Entry, list[Run]] = {entry: [] for entry in entries}
    interrupted = False
    try:
        for count, (entry, run) in enumerate(measure(entries, seeds, passed, options.jobs), 1):
            runs[entry].append(replace(run, seconds=None) if options.untimed else run)
            print(f"{count}/{len(entries) * len(seeds)} {_line(run)}", flush=True)
            finished = [of for of in runs.values() if len(of) == len(seeds)]
            text = document(finished, _command(options), seeds, len(entries), qualities)
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
