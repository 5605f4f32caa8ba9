"""Rows of the kernel as an assembly, and the sizes on the way to fewer parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from partwright.assembly import Assembly, Similarity
from partwright.assembly.parts_from_rows import parts_from_rows
from partwright.fields.columns import UNSIGNED, Column
from partwright.shapes import Shape
from partwright.superfrusta.curve import with_parents
from partwright.superfrusta.flat_tree import nested
from partwright.superfrusta.part_names import part_names
from partwright.superfrusta.samples import Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.solid_kinds import is_solid, solid

_STEM = {True: "part", False: "cut"}  # of the names of parts that are added, and subtracted


@dataclass(frozen=True)
class Step:
    """One size on the way down."""

    rows: Rows
    score: float
    iou: float


def chosen(steps: Sequence[Step], settings: Settings) -> Step:
    """The size that is the result, beside a curve of all: the best by the objective, at the settings' price.

    Of sizes within max_parts; with min_iou the smallest that reaches it, or the one that comes nearest.
    """
    most = settings.max_parts
    within = [step for step in steps if most is None or len(step.rows) <= most]
    within = within or [min(steps, key=lambda step: len(step.rows))]
    if settings.min_iou is None:
        return max(within, key=lambda step: step.score - settings.alpha * len(step.rows))
    reached = [step for step in within if step.iou >= settings.min_iou]
    if not reached:
        return max(within, key=lambda step: step.iou)
    return min(reached, key=lambda step: len(step.rows))


def assembly_of(
    shape: Shape,
    rows: Rows,
    settings: Settings,
    fixed: Sequence[str] = (),
    smaller: Assembly | None = None,
    moves: Sequence[tuple[Similarity, ...]] = (),
) -> Assembly:
    """Rows as an assembly in the shape's own units; parts name their parent in a smaller assembly.

    moves: those of each part's further copies, if any.
    """
    added = rows[:, Column.SIGN] > 0
    if settings.family == "solid":
        names = [*fixed, *(f"{_STEM[bool(added[i])]}_{i + 1:02d}" for i in range(len(fixed), len(rows)))]
    else:
        sides = shape.frame.length_to_unit(np.ptp(shape.vertices, axis=0))
        names = part_names(rows, sides, shape.up, fixed, moves)
    parts = parts_from_rows(rows[:, :UNSIGNED], names)
    if settings.family == "solid":
        parts = tuple(
            replace(part, field=solid(row)) if is_solid(row) else part
            for part, row in zip(parts, rows, strict=True)
        )
    if moves:
        parts = tuple(replace(part, instances=m) for part, m in zip(parts, moves, strict=True))
    whole = replace(nested(parts, added.tolist(), plain=not settings.smooth), unit=shape.unit)
    whole = whole.scaled(1 / shape.frame.scale).translated(shape.frame.centre)
    return whole if smaller is None else with_parents(whole, smaller)
