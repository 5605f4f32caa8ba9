"""Parts as the kernel's parameter rows, without their signs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import ParameterError
from partwright.fields import Field, SuperFrustum
from partwright.fields.columns import UNSIGNED

if TYPE_CHECKING:
    from partwright.assembly.tree import Part


def as_superfrustum(field: Field) -> SuperFrustum:
    """The SuperFrustum that the field is exactly.

    Raises:
        ParameterError: the field is no member of the SuperFrustum family.
    """
    own = field.superfrustum()
    if own is None:
        raise ParameterError(f"a field of kind {field.kind!r} is no SuperFrustum and cannot become one")
    return own


def rows(parts: Sequence[Part]) -> np.ndarray:
    """(M, 16) float64 parameter rows, in the parts' own units; a repeated part has a row for each copy."""
    copies = (copy for part in parts for copy in part.copies)
    return np.array(
        [(*p.translation, *p.rotation, *as_superfrustum(p.field).parameters(), p.blend) for p in copies]
    ).reshape(-1, UNSIGNED)
