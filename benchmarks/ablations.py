"""What each piece of Residual Primitive Fitting is worth: the fit with it changed, beside the default.

    python benchmarks/ablations.py --shapes FOLDER [--rows cuboid,CoACD] [--names mug,bunny] [--jobs 2]

Rows and their settings are in variants.py; --rows takes parts of their names. FOLDER is as for fit.py; twelve
of its shapes are taken where it has them. Needs the extras "torch" and "bench". The tables go to
benchmarks/results/ablations.md. Every single fit goes to the CSV file beside it and is not run again, unless
its settings change or --fresh is given: after changes of the code, give it.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import recorded
from fit import OWN_SHAPES, Entry, find_shapes, machine
from variants import BASE, NOTES, Variant, variants

from partwright.atomic_io import write_bytes
from partwright.errors import PartwrightError

RESULT = Path(__file__).parent / "results" / "ablations.md"
NAMES = (
    "mug", "chair_kk", "kettle", "bunny", "ycb_power_drill", "airplane", "armchair", "penguin",
    "f360_crank_web", "ttt_angle_bracket", "bdw_weld_neck_flange", "idler_riser",
)  # fmt: skip


@dataclass(frozen=True)
class Run:
    """One fit. chamfer: above the floor of two samples of the shape itself. seconds: CPU time of the fit."""

    variant: str
    shape: str
    settings: str
    iou: float
    bi_surface_iou: float
    chamfer: float
    parts: float
    overlap: float
    seconds: float
    failure: str = ""

    @property
    def key(self) -> tuple[str, str, str]:
        return self.variant, self.shape, self.settings


COLUMNS = (
    "shapes", "IoU", "bi-surface IoU", "Chamfer excess x1e3", "parts", "overlap", "seconds",
    "IoU ratio", "parts ratio", "seconds ratio",
)  # fmt: skip
NUMBERS = ("iou", "bi_surface_iou", "chamfer", "parts", "overlap", "seconds")


def digest(variant: Variant) -> str:
    return hashlib.sha256(repr(variant.settings).encode()).hexdigest()[:12]


def run(variant: Variant, entry: Entry) -> Run:
    """The fit and its scores; a fit that cannot be done has NaN for them, and says why."""
    from partwright.methods import FitRequest
    from partwright.methods import Run as MethodRun
    from partwright.metrics import evaluate
    from partwright.shapes import load_shape

    shape = load_shape(entry.path)
    start = time.process_time()
    try:
        with variant.hook():
            assembly = FitRequest(shape, variant.settings, MethodRun(threads=1)).fitted().assembly
        seconds = time.process_time() - start
        surface = None
        if variant.superquadrics:
            from superquadric import as_superquadrics, mesh

            assembly = as_superquadrics(assembly)
            surface = mesh(assembly)
        scores = evaluate(assembly, shape, emd=False, surface=surface)
    except PartwrightError as error:
        failure = f"{type(error).__name__}: {error}"
        none = dict.fromkeys(NUMBERS, float("nan"))
        return Run(variant.name, entry.name, digest(variant), **none, failure=failure)
    return Run(
        variant.name, entry.name, digest(variant),
        scores.iou, scores.bi_surface_iou, scores.chamfer - scores.chamfer_floor,
        scores.parts, scores.overlap, seconds,
    )  # fmt: skip


def chosen(rows: str) -> list[Variant]:
    """Variants whose name contains one of the words, and what they are compared with.

    Raises:
        SystemExit: a word is in no name.
    """
    every = variants()
    words = [word for word in rows.split(",") if word]
    if not words:
        return every
    for word in words:
        if not any(word in variant.name for variant in every):
            raise SystemExit(f"no row is called {word}; there are: {', '.join(v.name for v in every)}")
    wanted = [variant for variant in every if any(word in variant.name for word in words)]
    names = {v.name for v in wanted} | {v.base for v in wanted}
    return [variant for variant in every if variant.name in names]


def shapes(options: argparse.Namespace) -> list[Entry]:
    """The named shapes, in that order; by default the twelve of them that are there, or else all."""
    names = [*filter(None, options.names.split(","))]
    if names:
        found = find_shapes(options.shapes, set(), set(names))
        return sorted(found, key=lambda entry: names.index(entry.name))
    every = find_shapes(options.shapes, set(), set())
    usual = [entry for entry in every if entry.name in NAMES]
    return sorted(usual, key=lambda entry: NAMES.index(entry.name)) or every


def planned(rows: list[Variant], entries: list[Entry]) -> list[tuple[Variant, Entry]]:
    return [(row, entry) for row in rows for entry in (entries[::3] if row.few else entries)]


def load(path: Path) -> dict[tuple[str, str, str], Run]:
    """Runs from earlier that worked, by their key."""
    runs = recorded.read(path, Run)
    return {one.key: one for one in runs if not one.failure}


def save(path: Path, runs: dict[tuple[str, str, str], Run]) -> None:
    write_bytes(path, recorded.text(runs.values(), Run).encode())


def table(section: list[Variant], every: list[Variant], runs: dict[str, dict[str, Run]]) -> Iterator[str]:
    """Markdown: means over the shapes of each row, and ratios to the base over the shapes both have."""
    bases = dict.fromkeys(row.base for row in section)
    rows = [v for v in every if v.name in bases and v not in section] + section
    yield f"| | {' | '.join(COLUMNS)} |"
    yield "|---|" + "---:|" * len(COLUMNS)
    for row in rows:
        good = {name: one for name, one in runs.get(row.name, {}).items() if not one.failure}
        base = {name: one for name, one in runs.get(row.base, {}).items() if not one.failure}
        name = f"**{row.name}**" if row.name in bases else row.name
        if not good:
            yield f"| {name} |" + " - |" * len(COLUMNS)
            continue
        m = {number: mean(getattr(one, number) for one in good.values()) for number in NUMBERS}
        shared = good.keys() & base.keys()

        def ratio(number: str, good=good, base=base, shared=shared) -> str:
            below = sum(getattr(base[name], number) for name in shared)
            return f"{sum(getattr(good[name], number) for name in shared) / below:.3f}" if below else "-"

        yield (
            f"| {name} | {len(good)} | {m['iou']:.4f} | {m['bi_surface_iou']:.4f} | {1e3 * m['chamfer']:.3f} "
            f"| {m['parts']:.1f} | {m['overlap']:.3f} | {m['seconds']:.1f} "
            f"| {ratio('iou')} | {ratio('parts')} | {ratio('seconds')} |"
        )


def document(rows: list[Variant], entries: list[Entry], runs: list[Run], options: argparse.Namespace) -> str:
    by_row: dict[str, dict[str, Run]] = {}
    for one in runs:
        by_row.setdefault(one.variant, {})[one.shape] = one
    total = len(planned(rows, entries))
    unfinished = "" if len(runs) == total else f" Unfinished: {len(runs)} of {total} fits."
    lines = [
        "# Ablations",
        "",
        f"`{_command(options)}` on {machine()}.{unfinished}",
        "",
        f"Shapes: {', '.join(entry.name for entry in entries)}.",
        "",
        "Means over the shapes, or over every third of them where a row is slow. The default row has",
        f"{BASE.near:,} samples near the surface, as many in the box, and a grid of {BASE.resolution}: less",
        "than a user's fit, so that all rows run in minutes; rounds and cycles are the same. Seconds are CPU",
        "time of the fit alone, in one thread. Ratios are to the bold row, over the shapes that both have.",
        "",
    ]
    for section in dict.fromkeys(row.section for row in rows):
        members = [row for row in rows if row.section == section]
        lines += [f"## {section}", "", *table(members, rows, by_row), ""]
        if NOTES.get(section):
            lines += [NOTES[section], ""]
    failures = [f"- {one.variant}, {one.shape}: {one.failure}" for one in runs if one.failure]
    lines += ["## Failures", "", *failures, ""] if failures else []
    return "\n".join(lines)


def main() -> int:
    options = parser().parse_args()
    rows, entries = chosen(options.rows), shapes(options)
    result = RESULT.with_stem(f"{RESULT.stem}-{options.tag}") if options.tag else RESULT
    cache = result.with_suffix(".csv")
    known = {} if options.fresh else load(cache)
    todo = planned(rows, entries)
    keys = [(row.name, entry.name, digest(row)) for row, entry in todo]
    missing = [pair for pair, key in zip(todo, keys, strict=True) if key not in known]
    RESULT.parent.mkdir(exist_ok=True)
    os.environ["OMP_NUM_THREADS"] = "1"  # of the processes to come
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.jobs, context) as pool:
        futures = {pool.submit(run, *pair): pair for pair in missing}
        try:
            for count, future in enumerate(as_completed(futures), 1):
                one = future.result()
                known[one.key] = one
                save(cache, known)
                print(f"{count}/{len(missing)} {one.variant}, {one.shape}: {_line(one)}", flush=True)
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            return 130
    runs = [known[key] for key in keys if key in known]
    write_bytes(result, document(rows, entries, runs, options).encode())
    print(f"written to {result} and {cache.name}")
    return int(any(one.failure for one in runs))


def _line(one: Run) -> str:
    if one.failure:
        return one.failure
    return f"IoU {one.iou:.4f}, {one.parts:g} parts, overlap {one.overlap:.3f}, {one.seconds:.1f} s"


def _command(options: argparse.Namespace) -> str:
    """What to type to get this; of the folder of shapes only its name, wherever it lies."""
    given = {"--shapes": options.shapes.name if options.shapes != OWN_SHAPES else ""}
    given |= {"--rows": f'"{options.rows}"' if options.rows else "", "--names": options.names}
    given |= {"--tag": options.tag, "--jobs": options.jobs}
    return " ".join(["python benchmarks/ablations.py", *(f"{k} {v}" for k, v in given.items() if v)])


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--rows", default="", metavar="A,B", help="only rows with one of these in their name")
    option("--tag", default="", metavar="TAG", help="writes ablations-TAG.md")
    option("--jobs", type=int, default=2, metavar="N", help="fits at a time, each of one thread")
    option("--fresh", action="store_true", help="forget earlier runs")
    return result


if __name__ == "__main__":
    sys.exit(main())
