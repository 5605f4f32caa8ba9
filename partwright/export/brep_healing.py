"""Edges that are too short for a file: what boolean operations leave where surfaces nearly touch is valid
with their tolerances, which a file lacks, and reads as faces that cross themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_topology import volume_of

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

SHORT = (1.5e-5, 5e-5, 1.5e-4)
"""Lengths of edges that are dropped, of the cube root of a solid's volume, the least first."""
_WIDEST = 5.0  # times that: tolerances that may come of it


def without_short_edges(solid: TopoDS_Shape, share: float) -> TopoDS_Shape:
    """The solid without edges that are shorter than a share of the cube root of its volume, gaps between the
    others closed; itself where OpenCASCADE fails at that."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
    from OCP.ShapeFix import ShapeFix_Shape, ShapeFix_Wireframe

    length = share * abs(volume_of(solid)) ** (1 / 3)
    try:
        wires = ShapeFix_Wireframe(BRepBuilderAPI_Copy(solid).Shape())  # it changes what it is given
        wires.SetPrecision(length)
        wires.SetMaxTolerance(_WIDEST * length)
        wires.ModeDropSmallEdges = True
        wires.FixSmallEdges()
        wires.FixWireGaps()
        faces = ShapeFix_Shape(wires.Shape())
        faces.SetPrecision(length)
        faces.SetMaxTolerance(_WIDEST * length)
        faces.Perform()
        return faces.Shape()
    except opencascade_errors():
        return solid
