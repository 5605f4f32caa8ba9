"""A B-rep solid of flat facets, for what OpenCASCADE cannot build of analytic faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.meshing.csg import solid_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

    from partwright.assembly import Node

CHORD = 1 / 400  # of the longest side: how far facets may lie from the surface
SHORTEST = 1e-4  # of the longest side: shorter edges are collapsed, which OpenCASCADE would stumble over


def faceted(node: Node, fine: bool = False) -> TopoDS_Shape:
    """The exact mesh of a node of quadrics and named solids, its triangles sewn into a solid.

    fine: facets as near to the surface, by the node's shortest side.

    Raises:
        NoSurfaceError: nothing is left of the node, or its triangles do not close.
    """
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
        BRepBuilderAPI_MakeSolid,
        BRepBuilderAPI_Sewing,
    )
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    sides = np.ptp(np.array(node.bounds()), axis=0)
    longest = float(sides.max())
    chord = CHORD * float(sides.min() if fine else longest)
    places, triangles = surface_of(solid_of(node, chord).simplify(SHORTEST * longest))
    sewing = BRepBuilderAPI_Sewing(SHORTEST / 10 * longest)
    for triangle in triangles:
        outline = BRepBuilderAPI_MakePolygon(*(gp_Pnt(*places[i].tolist()) for i in triangle), True)
        if not outline.IsDone():
            raise NoSurfaceError("the facets of a node are too small for a B-rep")
        face = BRepBuilderAPI_MakeFace(outline.Wire(), True)
        if face.IsDone():  # a needle has no plane; sewing closes the slit that it leaves
            sewing.Add(face.Shape())
    sewing.Perform()
    shells = TopExp_Explorer(sewing.SewedShape(), TopAbs_ShapeEnum.TopAbs_SHELL)
    solid = BRepBuilderAPI_MakeSolid()
    if not shells.More():
        raise NoSurfaceError("the facets of a node do not close; export a mesh instead")
    while shells.More():
        solid.Add(TopoDS.Shell(shells.Current()))
        shells.Next()
    return solid.Solid()
