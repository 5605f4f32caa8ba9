"""Solids with and without subtraction beside SuperFrusta, on every shape of a set.

    python benchmarks/solids.py --shapes FOLDER --sets cad

Each fit is a `partwright fit` process of its own, as in benchmarks/fit.py. Every run is appended to
benchmarks/results/solids.csv as it ends, and those that are there are not made again: an interrupted
benchmark goes on where it was. Delete the file, or the rows of one variant, to measure anew.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
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
REACH = "mean IoU 0.90 or more, 16 parts or fewer on average, median of 15 seconds or less"


@dataclass(frozen=True)
class Row:
    """One fit. deviation: the largest, in % of the longest side. freeform: parts that are no features.
    Scores are nan where the fit failed."""

    variant: str
    name: str
    outcome: str
    iou: float
    bi_surface_iou: float
    parts: float
    instances: float
    overlap: float
    deviation: float
    seconds: float
    cpu_seconds: float
    freeform: float = 0.0


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
    return Row(
        variant,
        entry.name,
        made.outcome,
        **scores,
        seconds=made.seconds,
        cpu_seconds=cpu,
        freeform=float(freeform),
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
            f"{median(row.seconds for row in good):.1f} | {median(row.cpu_seconds for row in good):.1f} |"
        )


def shape_by_shape(rows: list[Row]) -> Iterator[str]:
    yield "| shape | " + " | ".join(f"{variant}: IoU | bi | parts | CPU s" for variant in VARIANTS) + " |"
    yield "|---|" + "---:|" * 4 * len(VARIANTS)
    found = {(row.name, row.variant): row for row in rows}
    for name in dict.fromkeys(row.name for row in rows):
        cells = []
        for variant in VARIANTS:
            row = found.get((name, variant))
            if row is None:
                cells += ["", "", "", ""]
            elif row.iou != row.iou:
                cells += [row.outcome, "", "", f"{row.cpu_seconds:.1f}"]
            else:
                parts = f"{row.parts:g}" + (f" ({row.freeform:g})" if row.freeform else "")
                cells += [f"{row.iou:.3f}", f"{row.bi_surface_iou:.3f}", parts]
                cells += [f"{row.cpu_seconds:.1f}"]
        yield f"| {name} | {' | '.join(cells)} |"


def document(rows: list[Row], command: str, planned: int) -> str:
    missing = planned - len(rows)
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
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    names, sets = ({*filter(None, text.split(","))} for text in (options.names, options.sets))
    entries = find_shapes(options.shapes, sets, names)
    chosen = [v for v in VARIANTS if v in options.variants] if options.variants else list(VARIANTS)
    path = options.output.with_suffix(".csv")
    command = f"python benchmarks/solids.py --shapes {options.shapes.name} --sets {options.sets}"
    for variant in chosen:
        for entry in entries:
            rows = recorded.read(path, Row)
            if any(row.variant == variant and row.name == entry.name for row in rows):
                continue
            with tempfile.TemporaryDirectory() as folder:
                row = run(variant, entry, (options.fits or Path(folder)) / variant / entry.name)
            recorded.append(path, row)
            print(
                f"{variant}: {entry.name}: IoU {row.iou:.3f}, {row.parts:g} parts, {row.seconds:.1f} s",
                flush=True,
            )
            write_bytes(
                options.output, document([*rows, row], command, len(entries) * len(VARIANTS)).encode()
            )
    rows = recorded.read(path, Row)
    write_bytes(options.output, document(rows, command, len(entries) * len(VARIANTS)).encode())
    print("", *summary(rows), sep="\n")
    return int(any(row.iou != row.iou for row in rows))


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
    option("-o", "--output", type=Path, default=RESULTS / "solids.md", metavar="FILE")
    return result


if __name__ == "__main__":
    sys.exit(main())
