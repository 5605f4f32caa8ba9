"""Solids with and without subtraction beside SuperFrusta, on every shape of a set.

    python benchmarks/solids.py --shapes FOLDER --sets cad
    python benchmarks/solids.py --shapes FOLDER --sets voron,prusa --variants solids --tag unseen --untimed

Each fit is a `partwright fit` process of its own, as in benchmarks/fit.py. Every run is appended to
benchmarks/results/solids.csv (solids-TAG.csv) as it ends, and those that are there are not made again: an
interrupted benchmark goes on where it was. Delete the file, or the rows of one variant, to measure anew.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean, median

import recorded
from fit import Entry, find_shapes, fit_once, machine

import partwright as pw
from partwright.approximation.part_roles import FREEFORM
from partwright.atomic_io import write_bytes

HERE = Path(__file__).parent
RESULTS = HERE / "results"
VARIANTS = {
    "solids": ["--method", "solids"],
    "solids, at most 20": ["--method", "solids", "--max-parts", "20"],
    "solids, only added": ["--method", "solids", "--no-subtract"],
    "superfrusta": [],
}
FAR = 3.0
"""% of the longest side, by which nothing should be off."""
REACH = "mean IoU 0.90 or more, 16 parts or fewer on average, median of 15 seconds or less"


@dataclass(frozen=True)
class Row:
    """One fit. deviation: the largest, in % of the longest side. freeform: parts that are no features.
    place: where it is off the most. warnings: what the fit said. Scores are nan where it failed."""

    variant: str
    name: str
    outcome: str
    iou: float
    bi_surface_iou: float
    parts: float
    instances: float
    overlap: float
    deviation: float
    seconds: float | None
    cpu_seconds: float
    freeform: float = 0.0
    place: str = ""
    warnings: str = ""


SCORES = ("iou", "bi_surface_iou", "parts", "instances", "overlap", "deviation")


def run(variant: str, entry: Entry, out: Path) -> Row:
    """One process; its CPU seconds are those of all threads, the start of Python and the files included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    made = fit_once(entry, 0, VARIANTS[variant], out)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    scores = {name: float("nan") if (v := getattr(made, name)) is None else float(v) for name in SCORES}
    whole = out / "assembly.json"
    names = [part.name for part in pw.load_assembly(whole).parts] if whole.exists() else []
    freeform = sum(name.startswith(FREEFORM) for name in names)
    told = out / "report.json"
    report = json.loads(told.read_text(encoding="utf-8")) if told.exists() else {}
    return Row(
        variant,
        entry.name,
        made.outcome,
        **scores,
        seconds=made.seconds,
        cpu_seconds=cpu,
        freeform=float(freeform),
        place=report["scores"]["worst_place"] if report else "",
        warnings=" / ".join(report.get("warnings", ())),
    )


def summary(rows: list[Row]) -> Iterator[str]:
    """A line a variant: means, and medians of the seconds."""
    yield (
        "| variant | shapes | IoU | bi-surface IoU | parts (copies) | freeform | overlap | deviation % "
        "| s | CPU s |"
    )
    yield "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    for variant in VARIANTS:
        good = [row for row in rows if row.variant == variant and row.iou == row.iou]
        if not good:
            continue
        m = {name: mean(getattr(row, name) for row in good) for name in (*SCORES, "freeform")}
        yield (
            f"| {variant} | {len(good)} | {m['iou']:.3f} | {m['bi_surface_iou']:.3f} | {m['parts']:.1f} "
            f"({m['instances']:.1f}) | {m['freeform']:.1f} | {m['overlap']:.2f} | {m['deviation']:.1f} | "
            f"{_seconds(good)} | {median(row.cpu_seconds for row in good):.1f} |"
        )


def _seconds(rows: list[Row]) -> str:
    """The median, where all were timed."""
    seconds = [row.seconds for row in rows if row.seconds is not None]
    return f"{median(seconds):.1f}" if len(seconds) == len(rows) else "-"


def shape_by_shape(rows: list[Row]) -> Iterator[str]:
    variants = [variant for variant in VARIANTS if any(row.variant == variant for row in rows)]
    header = (f"{variant}: IoU | bi | parts | deviation % | CPU s" for variant in variants)
    yield f"| shape | {' | '.join(header)} |"
    yield "|---|" + "---:|" * 5 * len(variants)
    found = {(row.name, row.variant): row for row in rows}
    for name in dict.fromkeys(row.name for row in rows):
        cells = []
        for variant in variants:
            row = found.get((name, variant))
            if row is None:
                cells += ["", "", "", "", ""]
            elif row.iou != row.iou:
                cells += [row.outcome, "", "", "", f"{row.cpu_seconds:.1f}"]
            else:
                parts = f"{row.parts:g}" + (f" ({row.freeform:g})" if row.freeform else "")
                cells += [f"{row.iou:.3f}", f"{row.bi_surface_iou:.3f}", parts, f"{row.deviation:.1f}"]
                cells += [f"{row.cpu_seconds:.1f}"]
        yield f"| {name} | {' | '.join(cells)} |"


def far_off(rows: list[Row]) -> Iterator[str]:
    """What is off by more than `FAR`, where it is, and what the fits said."""
    for row in rows:
        if row.deviation > FAR:
            yield f"- {row.name} ({row.variant}): {row.deviation:.1f} % off, {row.place}"
        if row.warnings:
            yield f"- {row.name} ({row.variant}) says: {row.warnings}"


def sources(entries: list[Entry]) -> Iterator[str]:
    """Where the shapes were published, where the index says so."""
    for entry in entries:
        if entry.source:
            yield f"- {entry.name}: {entry.source}"


def document(rows: list[Row], command: str, planned: int, entries: list[Entry]) -> str:
    missing = planned - len(rows)
    far, origins = list(far_off(rows)), list(sources(entries))
    lines = [
        "# Solids, with and without subtraction, and SuperFrusta",
        "",
        f"`{command}` on {machine()}."
        + (f" Unfinished: {missing} of {planned} fits are missing." * (missing > 0)),
        "",
        "Means over the shapes, medians of the seconds; default settings, seed 0. Seconds are those of whole",
        "processes, files read and written; CPU seconds add up all threads. Deviations are the largest, in",
        "% of the longest side. Freeform, in brackets below: parts that are no features, but follow the",
        f"shape where they would be far off. First reach of solids: {REACH}.",
        "",
        *summary(rows),
        "",
        *shape_by_shape(rows),
        *(["", f"Off by more than {FAR:g} %, and what the fits said:", "", *far] if far else []),
        *(["", "Where the shapes are from:", "", *origins] if origins else []),
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    names, sets = ({*filter(None, text.split(","))} for text in (options.names, options.sets))
    entries = find_shapes(options.shapes, sets, names)
    chosen = [v for v in VARIANTS if v in options.variants] if options.variants else list(VARIANTS)
    planned = len(entries) * len(chosen if options.tag else VARIANTS)
    output = RESULTS / (f"solids-{options.tag}.md" if options.tag else "solids.md")
    path = output.with_suffix(".csv")
    command = _command(options)
    for variant in chosen:
        for entry in entries:
            rows = recorded.read(path, Row)
            if any(row.variant == variant and row.name == entry.name for row in rows):
                continue
            with tempfile.TemporaryDirectory() as folder:
                row = run(variant, entry, (options.fits or Path(folder)) / variant / entry.name)
            row = replace(row, seconds=None) if options.untimed else row
            recorded.append(path, row)
            print(
                f"{variant}: {entry.name}: IoU {row.iou:.3f}, {row.parts:g} parts, "
                f"{row.cpu_seconds:.1f} CPU s",
                flush=True,
            )
            write_bytes(output, document([*rows, row], command, planned, entries).encode())
    rows = recorded.read(path, Row)
    write_bytes(output, document(rows, command, planned, entries).encode())
    print("", *summary(rows), sep="\n")
    return int(any(row.iou != row.iou for row in rows))


def _command(options: argparse.Namespace) -> str:
    """What to type to get this table; of the folder of shapes only its name, wherever it lies."""
    words = ["python benchmarks/solids.py", f"--shapes {options.shapes.name}", f"--sets {options.sets}"]
    words += [f"--variants {' '.join(options.variants)}"] if options.variants else []
    words += [f"--tag {options.tag}"] if options.tag else []
    return " ".join([*words, *(["--untimed"] if options.untimed else [])])


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="an index.json, or meshes")
    option("--sets", default="cad", metavar="A,B", help="only these sets (default: %(default)s)")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--variants", nargs="*", choices=tuple(VARIANTS), help="only these")
    option("--fits", type=Path, metavar="FOLDER", help="keep all fits, as FOLDER/VARIANT/NAME")
    option("--tag", default="", help="writes solids-TAG.md")
    option(
        "--untimed", action="store_true", help="leaves out all but CPU seconds: for a machine that is busy"
    )
    return result


if __name__ == "__main__":
    sys.exit(main())
