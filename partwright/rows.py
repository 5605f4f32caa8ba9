"""Products and lengths of rows with few columns: NumPy's numbers to the bit, several times sooner.

NumPy reduces an axis of three one row at a time; here whole columns are added instead, in the same order.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", bound=np.number[Any])
Floats = NDArray[Any]  # of single or double precision, as is what comes of them


def sums(rows: Floats) -> Floats:
    """(...,) of rows (..., D), D at least 1 and few: `rows.sum(axis=-1)`."""
    total: Floats = rows[..., 0]
    for column in range(1, rows.shape[-1]):
        total = total + rows[..., column]
    return total


def dots(one: Floats, other: Floats) -> Floats:
    """(...,) inner products of rows (..., D): `(one * other).sum(axis=-1)`."""
    return sums(one * other)


def lengths(rows: Floats) -> Floats:
    """(...,) Euclidean lengths of rows (..., D): `np.linalg.norm(rows, axis=-1)`."""
    return np.asarray(np.sqrt(sums(rows * rows)))


def corners(rows: NDArray[Number]) -> tuple[NDArray[Number], NDArray[Number]]:
    """Lowest and highest corner (D,) of the box around rows (N, D), N at least 1: `rows.min(axis=0)` and
    `rows.max(axis=0)`."""
    columns = np.ascontiguousarray(rows.T)
    return columns.min(axis=1), columns.max(axis=1)


def units(rows: Floats) -> Floats:
    """(..., D) rows of length 1 along rows (..., D); what has no length stays 0."""
    return rows / np.maximum(lengths(rows), np.finfo(rows.dtype).tiny)[..., None]


def following(rows: NDArray[Number]) -> NDArray[Number]:
    """Rows (N, ...), N at least 1, from the second on, then the first: `np.roll(rows, -1, axis=0)`."""
    return np.concatenate([rows[1:], rows[:1]])


def crosses(one: Floats, other: Floats) -> Floats:
    """(..., 3) cross products of rows (..., 3): `np.cross(one, other)`."""
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    x, y, z = other[..., 0], other[..., 1], other[..., 2]
    found = np.empty(np.broadcast_shapes(one.shape, other.shape), np.result_type(one, other))
    np.subtract(b * z, c * y, out=found[..., 0])
    np.subtract(c * x, a * z, out=found[..., 1])
    np.subtract(a * y, b * x, out=found[..., 2])
    return found
