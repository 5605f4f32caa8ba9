"""A quadric where its part lies: a quadric that is turned and moved stays one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.similarity import rotation_matrix

if TYPE_CHECKING:
    from partwright.assembly.tree import Part
    from partwright.fields import Quadric


def placed_quadric(part: Part) -> Quadric | None:
    """The part's field as a quadric of the assembly's frame, copies aside; None where it is none."""
    own = part.field.quadric()
    return None if own is None else own.moved(rotation_matrix(part.rotation), np.array(part.translation))
