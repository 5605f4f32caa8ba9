"""The page of fits: a row a shape, what the seeds are apart, and each quality beside the first."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from statistics import mean, median


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
    timed = [name for name in SECONDS if all(getattr(row, name) is not None for row in good)]
    return replace(
        total,
        **means,
        **{name: median(getattr(row, name) for row in good) for name in timed},
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
        row.set.removesuffix(of_quality(first)) for row in rows if row.set.endswith(of_quality(first))
    ):
        for quality in others:
            pairs = [
                (row, of[name + of_quality(quality), shape])
                for (group, shape), row in of.items()
                if group == name + of_quality(first) and (name + of_quality(quality), shape) in of
            ]
            if pairs:
                iou, surface = (
                    mean(getattr(b, score) - getattr(a, score) for a, b in pairs)
                    for score in ("iou", "bi_surface_iou")
                )
                parts = sum(b.parts or 0 for _, b in pairs) / sum(a.parts or 0 for a, _ in pairs)
                times = (_number(_times(pairs, number), 2) for number in SECONDS)
                cells = [f"{iou:+.4f}", f"{surface:+.4f}", f"{parts:.2f}", *times]
                yield f"| {name}{of_quality(quality)} | {' | '.join(cells)} |"


def of_quality(quality: str) -> str:
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


def document(runs: list[list[Run]], made: str, seeds: list[int], planned: int, qualities: list[str]) -> str:
    """The whole page, of the shapes (S, seeds) that are done. made: by which command, and where."""
    rows = [over_seeds(of) for of in runs]
    done = "" if len(rows) == planned else f" Unfinished: {len(rows)} of {planned} shapes."
    lines = [
        "# `partwright fit`, shape by shape",
        "",
        f"{made}.{done}",
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
