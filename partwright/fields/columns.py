"""Names of the columns of parameter rows and of the entries of steps, from the compiled kernel's own tables.

A row (17,) is indexed by `Column`, a step or a derivative (15,) by `Tangent`; the slices below are the runs
of them that belong together.
"""

from __future__ import annotations

try:
    from partwright._kernel import Column, Tangent
except ImportError as error:
    message = "the compiled kernel is missing or of another version than the Python beside it: install again"
    raise ImportError(message) from error

__all__ = ["Column", "Tangent"]

WIDTH = len(Column)
"""Of a row with its sign."""
UNSIGNED = WIDTH - 1
"""Of a row whose sign is left out: the part is added."""
STEP_WIDTH = len(Tangent)

TRANSLATION = slice(Column.TX, Column.TZ + 1)
ROTATION = slice(Column.QW, Column.QZ + 1)
POSE = slice(Column.TX, Column.QZ + 1)
SIZE = slice(Column.SX, Column.SZ + 1)
PROPORTIONS = slice(Column.ROUNDNESS, Column.ONION + 1)
"""Roundness, dilation, taper, bulge, onion."""
FIELD = slice(Column.SX, Column.ONION + 1)
"""Size and proportions: what the part alone is but for its place."""
SHAPE = slice(Column.SX, Column.BLEND + 1)
"""Size, proportions and blend: what steps are added to, entry by entry of `SHAPE_STEP`."""

TRANSLATION_STEP = slice(Tangent.TX, Tangent.TZ + 1)
ROTATION_STEP = slice(Tangent.WX, Tangent.WZ + 1)
POSE_STEP = slice(Tangent.TX, Tangent.WZ + 1)
SIZE_STEP = slice(Tangent.SX, Tangent.SZ + 1)
SHAPE_STEP = slice(Tangent.SX, Tangent.BLEND + 1)
