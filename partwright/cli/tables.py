"""What the commands print at the end."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from partwright.cli.interrupts import INTERRUPTED
from partwright.cli.terminal import counted, printable, say, warn
from partwright.shapes import length_text

if TYPE_CHECKING:
    from partwright.cleaning import Cleaned
    from partwright.cleaning.feature_relations import FeatureNumber
    from partwright.fitting import Result
    from partwright.metrics import CadScores, Scores


_RELATIONS = 40  # lines that are printed
_NUMBERS = 12


def finish_fit(result: Result, folder: Path) -> int:
    """Prints the outcome of a fit that was written to a folder; the exit code."""
    print_result(result, folder)
    if result.clean:
        print_relations(result.clean)
    warn(result.warnings)
    if result.outcome == "interrupted":
        warn([f"interrupted: {folder} holds the best assembly so far"])
        return INTERRUPTED
    return 0


def print_result(result: Result, folder: Path) -> None:
    """The outcome of a fit: scores, time, and where the files are."""
    unit = result.shape.unit
    if points := result.report.get("points"):
        table = _table(result.shape.name, result.scores.parts)
        for name, label in (
            ("mean", "points off, mean"),
            ("deviation_95", "95 %"),
            ("max_deviation", "most"),
        ):
            table.add_row(label, f"{length_text(points[name], unit)}, {_percent(points[f'{name}_share'])}")
    else:
        table = _scores_table(result.shape.name, result.scores, unit)
    for name, bound in result.report.get("bounds", {}).items():
        if isinstance(bound, dict):
            kept = "kept" if bound["kept"] else "missed"
            asked, reached = (length_text(bound[which], unit) for which in ("asked", "reached"))
            table.add_row(f"{name} {asked}", f"{kept}: {reached}")
        else:
            table.add_row("volume, of the shape's", f"{bound:.3f}")
    table.add_row("outcome", result.outcome.replace("_", " "))
    table.add_row("seconds", f"{result.report['seconds']['all']:.1f}")
    _print(table)
    say(f"written to {folder}")


def print_scores(name: str, scores: Scores, unit: str | None) -> None:
    _print(_scores_table(name, scores, unit))


def print_relations(cleaned: Cleaned) -> None:
    """What cleaning found, a line each, and how many more there are."""
    for relation in cleaned.relations[:_RELATIONS]:
        say(relation)
    if len(cleaned.relations) > _RELATIONS:
        say(f"and {len(cleaned.relations) - _RELATIONS} relations more, all of them in the report")
    for number in _told(cleaned.numbers):
        say(f"{number}{f' {cleaned.assembly.unit}' if cleaned.assembly.unit else ''}")
    if len(cleaned.numbers) > _NUMBERS:
        say(f"{len(cleaned.numbers)} numbers of features, nominal beside measured, are in the report")


def _told(numbers: Sequence[FeatureNumber]) -> list[FeatureNumber]:
    """Standard holes first, then those that moved most."""
    ranked = sorted(numbers, key=lambda one: (not one.standard, -abs(one.deviation)))
    return [one for one in ranked if one.standard or one.deviation][:_NUMBERS]


def print_cleaned(cleaned: Cleaned, path: Path) -> None:
    """The relations, and how much was lost."""
    print_relations(cleaned)
    before, after, unit = cleaned.before, cleaned.after, cleaned.assembly.unit
    was, now = (length_text(one.mean_deviation, unit) for one in (before, after))
    say(
        f"{counted(before.parts, 'part')} -> {after.parts}, IoU {before.iou:.4f} -> {after.iou:.4f}, "
        f"mean deviation {was} -> {now}: {path}"
    )


def _table(name: str, parts: int) -> Table:
    table = Table(title=escape(printable(name)), box=box.SIMPLE_HEAD, show_header=False, title_justify="left")
    table.add_column()
    table.add_column(justify="right")
    table.add_row("parts", str(parts))
    return table


def _scores_table(name: str, scores: Scores, unit: str | None) -> Table:
    table = _table(name, scores.parts)
    table.add_row("IoU", f"{scores.iou:.4f}")
    table.add_row("bi-surface IoU", f"{scores.bi_surface_iou:.4f}")
    table.add_row("Chamfer x 1000", f"{1e3 * scores.chamfer:.3f} (floor {1e3 * scores.chamfer_floor:.3f})")
    if scores.emd is not None:
        table.add_row("EMD", f"{scores.emd:.4f}")
    table.add_row("overlap", f"{scores.overlap:.3f}")
    off = length_text(scores.deviation_95, unit)
    table.add_row("95 % deviation", f"{off}, {_percent(scores.deviation_95_share)}")
    share = _percent(scores.max_deviation_share)
    most = length_text(scores.max_deviation, unit)
    table.add_row("largest deviation", f"{most}, {share}, {scores.worst_place}")
    beyond = _percent(scores.max_protrusion_share)
    table.add_row("sticks out by", f"{length_text(scores.max_protrusion, unit)}, {beyond}")
    if scores.cad is not None:
        _add_cad_rows(table, scores.cad)
    return table


def _percent(share: float) -> str:
    """Of the longest side."""
    return f"{100 * share:.2f} %"


def _add_cad_rows(table: Table, scores: CadScores) -> None:
    """The measures of CAPRI-Net's tables, each beside its floor."""
    table.add_row("points of these", f"{scores.points:,}")
    for name, label, scale in (
        ("chamfer", "Chamfer x 1000", 1e3),
        ("normal_consistency", "normal consistency", 1.0),
        ("edge_chamfer", "edge Chamfer x 1000", 1e3),
    ):
        value, floor = getattr(scores, name), getattr(scores, f"{name}_floor")
        table.add_row(label, f"{scale * value:.3f} (floor {scale * floor:.3f})")
    table.add_row("light field distance", f"{scores.light_field_distance:.0f}")
    table.add_row("primitives, convexes", f"{scores.primitives}, {scores.convexes}")


def _print(table: Table) -> None:
    Console(width=None if sys.stdout.isatty() else 100).print(table)
