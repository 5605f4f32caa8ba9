"""Families of parts: SuperFrusta with some parameters locked at plain values (SuperFrusta, Table 2)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import Column

Family = Literal["superfrustum", "superprimitive", "cuboid", "solid"]

# family -> the parameters that its parts do not have, and the values that switch them off
FAMILIES: dict[Family, dict[Column, float]] = {
    "superfrustum": {},
    "superprimitive": {Column.TAPER: 1.0, Column.BULGE: 0.0},
    "cuboid": {
        Column.ROUNDNESS: 0.0,
        Column.DILATION: 0.0,
        Column.TAPER: 1.0,
        Column.BULGE: 0.0,
        Column.ONION: 0.0,
    },
    "solid": {Column.BULGE: 0.0},  # what else is locked in each part is its kind's: see solid_kinds.py
}


def locked_values(family: Family, smooth: bool) -> dict[Column, float]:
    """Parameters that no fit moves; in plain unions (not `smooth`) the blend is one of them."""
    return FAMILIES[family] if smooth else FAMILIES[family] | {Column.BLEND: 0.0}


def with_locked_values(rows: NDArray[np.float32], values: dict[Column, float]) -> NDArray[np.float32]:
    """Rows (K, 16) with these values instead of their own; of rows that are the same then, the first."""
    if not values:
        return rows
    rows = rows.copy()
    for column, value in values.items():
        rows[:, column] = value
    _, first = np.unique(rows, axis=0, return_index=True)
    return rows[np.sort(first)]
