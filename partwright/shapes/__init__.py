"""What comes in: files to shapes with an inside, a unit frame, distances and samples."""

from __future__ import annotations

from partwright.shapes.distance import DistanceSource, MeshDistance
from partwright.shapes.frame import LONGEST_SIDE, UnitFrame
from partwright.shapes.grid import DistanceGrid
from partwright.shapes.holes import Openings
from partwright.shapes.lengths import Length, own_length, parse_length
from partwright.shapes.reading import MESH_SUFFIXES, PICTURE_SUFFIXES, SUFFIXES
from partwright.shapes.sampling import Samples, SurfaceSamples
from partwright.shapes.shape import Node, NodeLeftOutWarning, Shape, load_shape
from partwright.shapes.units import METRES, UP_AXES, canonical_unit, canonical_up, length_text

__all__ = [
    "LONGEST_SIDE",
    "MESH_SUFFIXES",
    "METRES",
    "PICTURE_SUFFIXES",
    "SUFFIXES",
    "UP_AXES",
    "DistanceGrid",
    "DistanceSource",
    "Length",
    "MeshDistance",
    "Node",
    "NodeLeftOutWarning",
    "Openings",
    "Samples",
    "Shape",
    "SurfaceSamples",
    "UnitFrame",
    "canonical_unit",
    "canonical_up",
    "length_text",
    "load_shape",
    "own_length",
    "parse_length",
]
