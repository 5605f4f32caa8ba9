"""Families of parts: SuperFrusta some of whose parameters are held at plain values (SuperFrusta, Table 2)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from partwright.fields import kernel

Family = Literal["superfrustum", "superprimitive", "cuboid", "solid"]

# family -> the parameters that its parts do not have, and the values that switch them off
FAMILIES: dict[Family, dict[str, float]] = {
    "superfrustum": {},
    "superprimitive": {"taper": 1.0, "bulge": 0.0},
    "cuboid": {"roundness": 0.0, "dilation": 0.0, "taper": 1.0, "bulge": 0.0, "onion": 0.0},
    "solid": {"bulge": 0.0},  # what else each part holds is its kind's: see solid_kinds.py
}


def held(family: Family, smooth: bool) -> dict[str, float]:
    """Parameters that no fit moves; in plain unions (not `smooth`) the blend is one of them."""
    return FAMILIES[family] if smooth else FAMILIES[family] | {"blend": 0.0}


def held_down(rows: NDArray[np.float32], values: dict[str, float]) -> NDArray[np.float32]:
    """Rows (K, 16) with these values instead of their own; of rows that are the same then, the first."""
    if not values:
        return rows
    rows = rows.copy()
    for name, value in values.items():
        rows[:, kernel.COLUMNS.index(name)] = value
    _, first = np.unique(rows, axis=0, return_index=True)
    return rows[np.sort(first)]
