"""Parts to and from the kernel's parameter rows: tx ty tz qw qx qy qz sx sy sz r d t b o blend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.assembly.tree import Part
from partwright.errors import ParameterError
from partwright.fields import Field, Solid, SuperFrustum

WIDTH = 16


def is_superfrustum(field: Field) -> bool:
    """Whether the kernel knows the field: a SuperFrustum, or a named solid that is one exactly."""
    return isinstance(field, SuperFrustum | Solid)


def as_superfrustum(field: Field) -> SuperFrustum:
    """The SuperFrustum that the field is exactly.

    Raises:
        ParameterError: the field is no member of the SuperFrustum family.
    """
    if not isinstance(field, SuperFrustum | Solid):
        raise ParameterError(f"a field of kind {field.kind!r} is no SuperFrustum and cannot become one")
    return field.superfrustum()


def rows(parts: Sequence[Part]) -> np.ndarray:
    """(M, 16) float64 parameter rows, in the parts' own units; a repeated part has a row for each copy."""
    copies = (copy for part in parts for copy in part.copies)
    return np.array(
        [(*p.translation, *p.rotation, *as_superfrustum(p.field).parameters(), p.blend) for p in copies]
    ).reshape(-1, WIDTH)


def parts_from_rows(rows: np.ndarray, names: Sequence[str] = ()) -> tuple[Part, ...]:
    """Parts of (M, 16) parameter rows. float32 values keep their shortest decimal form: 0.1, not 0.100000001.

    Raises:
        ParameterError: the shape is wrong or a value is outside its range.
    """
    rows = np.asarray(rows)
    if rows.ndim != 2 or rows.shape[1] != WIDTH:
        raise ParameterError(f"parameter rows: expected shape (M, {WIDTH}), got {rows.shape}")
    if names and len(names) != len(rows):
        raise ParameterError(f"parameter rows: got {len(rows)} rows and {len(names)} names")
    result = []
    for i, row in enumerate(rows):
        v = [float(str(value)) for value in row]
        field = SuperFrustum.from_parameters(v[7:15])
        name = names[i] if names else ""
        result.append(Part(field, (v[0], v[1], v[2]), (v[3], v[4], v[5], v[6]), blend=v[15], name=name))
    return tuple(result)
