"""Assemblies brought to the frame in which they are measured."""

from __future__ import annotations

from partwright.assembly import Assembly, Similarity
from partwright.shapes import LONGEST_SIDE, UnitFrame


def in_unit_frame(assembly: Assembly, frame: UnitFrame) -> Assembly:
    """The assembly in a shape's unit frame."""
    x, y, z = (-frame.scale * value for value in frame.centre)
    return assembly.transformed(Similarity(frame.scale, translation=(x, y, z)))


def in_own_frame(assembly: Assembly) -> Assembly:
    """The assembly centred, its bounds' longest side as that of a unit frame."""
    lower, upper = assembly.bounds()
    scale = LONGEST_SIDE / float((upper - lower).max())
    x, y, z = (-scale * (lower + upper) / 2).tolist()
    return assembly.transformed(Similarity(scale, translation=(x, y, z)))
