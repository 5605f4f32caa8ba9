"""Parts of the kernel's parameter rows, the inverse of `rows`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.assembly.tree import Part
from partwright.errors import ParameterError
from partwright.fields import SuperFrustum
from partwright.fields.columns import FIELD, POSE, UNSIGNED, Column


def parts_from_rows(rows: np.ndarray, names: Sequence[str] = ()) -> tuple[Part, ...]:
    """Parts of (M, 16) parameter rows. float32 values keep their shortest decimal form: 0.1, not 0.100000001.

    Raises:
        ParameterError: the shape is wrong or a value is outside its range.
    """
    rows = np.asarray(rows)
    if rows.ndim != 2 or rows.shape[1] != UNSIGNED:
        raise ParameterError(f"parameter rows: expected shape (M, {UNSIGNED}), got {rows.shape}")
    if names and len(names) != len(rows):
        raise ParameterError(f"parameter rows: got {len(rows)} rows and {len(names)} names")
    result = []
    for i, row in enumerate(rows):
        v = [float(str(value)) for value in row]
        tx, ty, tz, qw, qx, qy, qz = v[POSE]
        field = SuperFrustum.from_parameters(v[FIELD])
        name = names[i] if names else ""
        result.append(Part(field, (tx, ty, tz), (qw, qx, qy, qz), blend=v[Column.BLEND], name=name))
    return tuple(result)
