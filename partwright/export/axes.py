"""From an assembly's own unit and axes to those that a robotics format demands: metres, Z up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from partwright.assembly import Similarity
from partwright.export.glb import to_gltf

if TYPE_CHECKING:
    from partwright.assembly import Assembly

_Y_TO_Z = Similarity(rotation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0))


def to_metres_z_up(assembly: Assembly) -> Similarity:
    """As far as unit and up axis are known; what is unknown stays as it is, and `unknowns` says so."""
    frame = to_gltf(assembly)
    return _Y_TO_Z @ frame if assembly.up else frame


def unknowns(assembly: Assembly) -> list[str]:
    """A sentence on each of unit and up axis that is unknown."""
    notes = []
    if assembly.unit is None:
        notes.append("the length unit is unknown: numbers are as in the assembly, read as metres")
    if assembly.up is None:
        notes.append("the up axis is unknown: axes are as in the assembly, read as Z up")
    return notes
