"""Quadrics that no named solid is, as exact B-rep solids.

Ellipsoids and elliptic cylinders and cones are their round counterpart, stretched, which makes the faces
rational B-splines; paraboloids and hyperboloids are a conic turned about the axis, parabolic cylinders one
extruded.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.errors import ParameterError
from partwright.export.brep_topology import side_by_side
from partwright.fields import NormalForm

if TYPE_CHECKING:
    from OCP.gp import gp_Ax2
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape

HELD = {
    "ellipsoid",
    "elliptic cylinder",
    "elliptic cone",
    "paraboloid",
    "elliptic paraboloid",
    "hyperboloid of one sheet",
    "hyperboloid of two sheets",
    "parabolic cylinder",
}
_SHORTEST = 1e-9
_Point = tuple[float, float, float]


def quadric_solid(form: NormalForm, radius: float) -> TopoDS_Shape:
    """A solid that is the form's within the ball of that radius about the origin.

    Raises:
        ParameterError: the surface is a saddle, a hyperbolic cylinder or a pair of crossing planes.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    if form.name not in HELD:
        raise ParameterError(
            f"STEP: a {form.name} has no solid here; export the surface as GLB, 3MF, OBJ, PLY or STL instead"
        )
    half = radius + float(np.linalg.norm(form.centre))  # of the ball about the form's centre that holds it
    solid = _placed(_turned(form, half) if form.curvature[1] else _trough(form, half), form)
    if not form.complement:
        return solid
    around = BRepPrimAPI_MakeBox(gp_Pnt(-radius, -radius, -radius), gp_Pnt(radius, radius, radius))
    return BRepAlgoAPI_Cut(around.Shape(), solid).Shape()


def _turned(form: NormalForm, half: float) -> TopoDS_Shape:
    """k1 (u^2 + v^2) <= level - k3 w^2 - slope w turned about w, then stretched along v."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_GTransform
    from OCP.gp import gp_GTrsf, gp_Mat, gp_XYZ

    shape = _round(form, half)
    if form.round and form.level and form.name != "ellipsoid":
        return shape  # a round paraboloid's tip needs to be a B-spline's
    stretch = np.array([1.0, math.sqrt(form.curvature[0] / form.curvature[1]), 1.0])
    if form.name == "ellipsoid":
        stretch = form.radii
    matrix = gp_Mat(stretch[0], 0, 0, 0, stretch[1], 0, 0, 0, stretch[2])
    return BRepBuilderAPI_GTransform(shape, gp_GTrsf(matrix, gp_XYZ(0, 0, 0)), True).Shape()


def _round(form: NormalForm, half: float) -> TopoDS_Shape:
    from OCP.BRepPrimAPI import (
        BRepPrimAPI_MakeCone,
        BRepPrimAPI_MakeCylinder,
        BRepPrimAPI_MakeRevol,
    )
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    if form.name == "ellipsoid":
        return _quartered_ball()
    if form.name == "elliptic cylinder":
        return BRepPrimAPI_MakeCylinder(_along(-half), float(form.radii[0]), 2 * half).Shape()
    if form.name == "elliptic cone":
        wide = half * form.widening
        nappes = [
            BRepPrimAPI_MakeCone(_along(0.0), 0.0, wide, half),
            BRepPrimAPI_MakeCone(_along(-half), wide, 0.0, half),
        ]
        return side_by_side([nappe.Shape() for nappe in nappes])
    axis = gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))
    return side_by_side([BRepPrimAPI_MakeRevol(face, axis).Shape() for face in _profiles(form, half)])


def _quartered_ball() -> TopoDS_Shape:
    """The unit ball, its face in four: a B-spline that closes on itself does not survive being written."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    shape = None
    for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)):
        axes = gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1), gp_Dir(x, y, 0))
        quarter = BRepPrimAPI_MakeSphere(axes, 1.0, math.pi / 2).Shape()
        shape = quarter if shape is None else BRepAlgoAPI_Fuse(shape, quarter).Shape()
    return shape


def _profiles(form: NormalForm, half: float) -> list[TopoDS_Face]:
    """What is turned, in the xz-plane: between the axis, a conic, and a line where the ball ends."""
    from OCP.Geom import Geom_Hyperbola, Geom_Parabola

    k, level = form.curvature, form.level
    if form.slope:
        far = math.sqrt(form.slope * half / k[0])
        edge = _edge(Geom_Parabola(_in_xz((0, 0, -1), (1, 0, 0)), form.slope / (4 * k[0])), 0.0, far)
        return [_face(edge, [(far, 0, -half), (0, 0, -half), (0, 0, 0)])]
    along, across = math.sqrt(abs(level / k[2])), math.sqrt(abs(level) / k[0])
    if level > 0:  # of one sheet
        end = math.asinh(half / along)
        edge = _edge(Geom_Hyperbola(_in_xz((1, 0, 0), (0, 0, 1)), across, along), -end, end)
        wide = across * math.cosh(end)
        return [_face(edge, [(wide, 0, half), (0, 0, half), (0, 0, -half), (wide, 0, -half)])]
    faces = []
    if half > along:
        end = math.acosh(half / along)
        wide = across * math.sinh(end)
        for up in (1, -1):
            edge = _edge(Geom_Hyperbola(_in_xz((0, 0, up), (1, 0, 0)), along, across), 0.0, end)
            faces.append(_face(edge, [(wide, 0, up * half), (0, 0, up * half), (0, 0, up * along)]))
    return faces


def _trough(form: NormalForm, half: float) -> TopoDS_Shape:
    """Inside of a parabola of u and w, extruded along v."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.Geom import Geom_Parabola
    from OCP.gp import gp_Vec

    far = math.sqrt(form.slope * half / form.curvature[0])
    curve = Geom_Parabola(_in_xz((0, 0, -1), (1, 0, 0), -half), form.slope / (4 * form.curvature[0]))
    face = _face(_edge(curve, -far, far), [(far, -half, -half), (-far, -half, -half)])
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 2 * half, 0)).Shape()


def _in_xz(symmetry: _Point, across: _Point, y: float = 0.0) -> gp_Ax2:
    """The axes of a conic whose own x and y are these directions."""
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    normal = np.cross(symmetry, across).tolist()
    return gp_Ax2(gp_Pnt(0, y, 0), gp_Dir(*normal), gp_Dir(*symmetry))


def _along(start: float) -> gp_Ax2:
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return gp_Ax2(gp_Pnt(0, 0, start), gp_Dir(0, 0, 1))


def _edge(curve: Any, start: float, end: float) -> TopoDS_Edge:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

    return BRepBuilderAPI_MakeEdge(curve, start, end).Edge()


def _face(curved: TopoDS_Edge, corners: list[_Point]) -> TopoDS_Face:
    """Between a curved edge and lines from its end by way of the corners to its start."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Pnt
    from OCP.TopExp import TopExp

    wire = BRepBuilderAPI_MakeWire(curved)
    first, last = (BRep_Tool.Pnt_s(v) for v in (TopExp.FirstVertex_s(curved), TopExp.LastVertex_s(curved)))
    stops = [last, *(gp_Pnt(*corner) for corner in corners), first]
    for start, end in pairwise(stops):
        if start.Distance(end) > _SHORTEST:
            wire.Add(BRepBuilderAPI_MakeEdge(start, end).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()


def _placed(shape: TopoDS_Shape, form: NormalForm) -> TopoDS_Shape:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Trsf

    pose = gp_Trsf()
    pose.SetValues(*np.column_stack([form.axes, form.centre]).ravel().tolist())
    return BRepBuilderAPI_Transform(shape, pose, True).Shape()
