"""A quadric where its part lies: a quadric that is turned and moved stays one."""

from __future__ import annotations

import numpy as np

from partwright.assembly.similarity import rotation_matrix
from partwright.assembly.tree import Part
from partwright.fields import Quadric


def placed_quadric(part: Part) -> Quadric:
    """The quadric of a part, which has to be one, in the assembly's frame; copies aside."""
    assert isinstance(part.field, Quadric)
    return part.field.moved(rotation_matrix(part.rotation), np.array(part.translation))
