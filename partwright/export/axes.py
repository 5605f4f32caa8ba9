"""From an assembly's own unit and axes to those that a format demands: metres, and Z or Y up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from partwright.assembly import Similarity
from partwright.assembly.similarity import NO_ROTATION
from partwright.shapes import METRES, canonical_unit, canonical_up

if TYPE_CHECKING:
    from partwright.assembly import Assembly

_HALF = math.sqrt(0.5)
_Y_TO_Z = Similarity(rotation=(_HALF, _HALF, 0.0, 0.0))
# up axis -> the rotation that turns it to +Y
_TO_Y_UP = {
    "y": NO_ROTATION,
    "-y": (0.0, 1.0, 0.0, 0.0),
    "z": (_HALF, -_HALF, 0.0, 0.0),
    "-z": (_HALF, _HALF, 0.0, 0.0),
    "x": (_HALF, 0.0, 0.0, _HALF),
    "-x": (_HALF, 0.0, 0.0, -_HALF),
}


def to_gltf(assembly: Assembly) -> Similarity:
    """From the assembly's own units and axes to metres and Y up, as far as they are known."""
    scale = METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0
    return Similarity(scale, _TO_Y_UP[canonical_up(assembly.up)] if assembly.up else NO_ROTATION)


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
