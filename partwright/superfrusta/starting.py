"""An assembly that a fit starts from, as rows of the kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.assembly.rows import rows as rows_of
from partwright.errors import SettingError
from partwright.fields.columns import Column
from partwright.shapes import Shape
from partwright.superfrusta.flat_tree import flattened
from partwright.superfrusta.samples import NOTHING, Rows
from partwright.superfrusta.settings import Settings


def starting_rows(
    shape: Shape, start: Assembly | None, locked: Sequence[str], settings: Settings
) -> tuple[Rows, tuple[str, ...]]:
    """Rows of an assembly in the shape's unit frame, locked parts first, and their names in that order.

    For a fit of solids, parts that are none become the nearest one.
    """
    if start is None:
        if locked:
            raise SettingError("locked parts need an assembly to start from")
        return NOTHING, ()
    unit = start.translated([-c for c in shape.frame.centre]).scaled(shape.frame.scale)
    unknown = set(locked) - {part.name for part in unit.parts}
    if unknown:
        names = ", ".join(part.name for part in unit.parts)
        raise SettingError(f"no part is named {', '.join(sorted(unknown))}; the start has {names}")
    leaves = [(copy, plus) for part, plus in flattened(unit) for copy in part.copies]
    if settings.subtract is False and not all(plus for _, plus in leaves):
        raise SettingError("the start subtracts parts; allow it to the fit: leave out --no-subtract")
    leaves.sort(key=lambda leaf: leaf[0].name not in locked)
    fixed = tuple(part.name for part, _ in leaves if part.name in locked)
    if settings.family == "solid":
        leaves = [(part if part.name in locked else nearest_part(part), plus) for part, plus in leaves]
    signs = np.array([[1.0 if plus else -1.0] for _, plus in leaves])
    rows = np.hstack([rows_of([part for part, _ in leaves]), signs]).astype(np.float32)
    if not settings.smooth:
        rows[len(fixed) :, Column.BLEND] = 0
    return rows, fixed


def nearest_part(part: Part) -> Part:
    """The part as the nearest named solid."""
    from partwright.approximation.nearest import nearest_solid

    return nearest_solid(part).part_with_solid
