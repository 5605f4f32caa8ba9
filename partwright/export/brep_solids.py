"""One exact solid: a rounded profile turned about the axis, or a rounded rectangle extruded along it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from partwright.errors import NoSurfaceError
from partwright.export.recognise import SAME
from partwright.fields import SuperFrustum

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

Point = tuple[float, float]


def revolved(f: SuperFrustum) -> TopoDS_Shape:
    """The solid of a round, straight SuperFrustum: docs/superfrustum.md's profile, offset by the dilation."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    m, h = min(f.size[:2]) / 2, f.size[2] / 2
    corners = [(m, -h), (m * f.taper, h)]
    if f.hollow:
        corners += [(m * f.taper * f.onion, h), (m * f.onion, -h)]
    longest = 2 * max(m, m * f.taper, h) + 2 * f.dilation
    outline = _Outline(upright=True, shortest=SAME * longest)
    d = f.dilation if f.dilation > outline.shortest else 0.0
    _profile(outline, corners, d, f.hollow)
    return BRepPrimAPI_MakeRevol(outline.face(), gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape()


def prism(f: SuperFrustum) -> TopoDS_Shape:
    """The solid of a straight SuperFrustum of one cross-section, all edges rounded by the dilation."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    d = f.dilation if f.dilation > SAME * max(f.size) else 0.0
    x, y, z = (side / 2 + d for side in f.size)
    radius = f.roundness * min(f.size[:2]) / 2
    if radius <= SAME * max(f.size):
        box = BRepPrimAPI_MakeBox(gp_Pnt(-x, -y, -z), gp_Pnt(x, y, z)).Shape()
        return _rounded(box, d, all_edges=True)
    outline = _Outline(upright=False, shortest=SAME * max(x, y, z), height=-z)
    inset_x, inset_y = x - radius - d, y - radius - d
    for i, (sx, sy) in enumerate(((1, -1), (1, 1), (-1, 1), (-1, -1))):
        outline.arc((sx * inset_x, sy * inset_y), radius + d, math.pi / 2 * (i - 1), math.pi / 2 * i)
    return _rounded(BRepPrimAPI_MakePrism(outline.face(), gp_Vec(0, 0, 2 * z)).Shape(), d, all_edges=False)


def _profile(outline: _Outline, corners: list[Point], d: float, hollow: bool) -> None:
    """Counter-clockwise around the corners; where there is no hole, from the axis to the axis."""
    normals = [_normal(a, b) for a, b in pairwise(corners)]
    if hollow:
        normals[2] = _normal(corners[2], corners[3], inner=True)
        turns = [-math.pi / 2, normals[0], math.pi / 2, normals[2], 3 * math.pi / 2]
    else:
        outline.to((0.0, corners[0][1] - d))
        turns = [-math.pi / 2, normals[0], math.pi / 2]
    for corner, start, end in zip(corners, turns, turns[1:], strict=False):
        outline.arc(corner, d, start, end)
    if not hollow:
        outline.to((0.0, corners[1][1] + d))


def _normal(a: Point, b: Point, inner: bool = False) -> float:
    """Direction, as an angle, of the outward normal of the wall from a to b; level where they coincide."""
    along, up = b[0] - a[0], b[1] - a[1]
    if along == 0 and up == 0:
        return math.pi if inner else 0.0
    angle = math.atan2(-along, up)
    return angle % (2 * math.pi) if inner else angle


class _Outline:
    """A closed line of segments and arcs in the xz-plane, or in the xy-plane at a height."""

    def __init__(self, upright: bool, shortest: float, height: float = 0.0) -> None:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire

        self.upright, self.shortest, self.height = upright, shortest, height
        self._wire = BRepBuilderAPI_MakeWire()
        self._first: Point | None = None
        self._last: Point = (0.0, 0.0)

    def to(self, point: Point) -> None:
        """A segment from the end of the line so far, unless that is here already; or the line's beginning."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

        if self._first is None:
            self._first = self._last = point
        elif math.dist(self._last, point) > self.shortest:
            self._wire.Add(BRepBuilderAPI_MakeEdge(self._at(self._last), self._at(point)).Edge())
            self._last = point

    def arc(self, centre: Point, radius: float, start: float, end: float) -> None:
        """A segment to the arc's beginning, and the arc, counter-clockwise between two angles."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
        from OCP.GC import GC_MakeArcOfCircle

        def on_circle(angle: float) -> Point:
            return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)

        self.to(on_circle(start))
        if math.dist(on_circle(start), on_circle(end)) <= self.shortest:
            return
        middle, last = on_circle((start + end) / 2), on_circle(end)
        arc = GC_MakeArcOfCircle(self._at(self._last), self._at(middle), self._at(last)).Value()
        self._wire.Add(BRepBuilderAPI_MakeEdge(arc).Edge())
        self._last = last

    def face(self) -> TopoDS_Face:
        """The closed line's inside.

        Raises:
            NoSurfaceError: it encloses nothing.
        """
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace

        if self._first is not None and math.dist(self._first, self._last) > self.shortest / 10:
            self._wire.Add(BRepBuilderAPI_MakeEdge(self._at(self._last), self._at(self._first)).Edge())
        if not self._wire.IsDone():
            raise NoSurfaceError("a part's outline does not close; it is too thin for a B-rep")
        return BRepBuilderAPI_MakeFace(self._wire.Wire(), True).Face()

    def _at(self, point: Point):  # type: ignore[no-untyped-def]  # a gp_Pnt
        from OCP.gp import gp_Pnt

        return gp_Pnt(point[0], 0, point[1]) if self.upright else gp_Pnt(*point, self.height)


def _rounded(solid: TopoDS_Shape, radius: float, all_edges: bool) -> TopoDS_Shape:
    """All edges, or those of the two ends, rounded by the radius; 0 leaves them."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    if radius == 0:
        return solid
    fillet = BRepFilletAPI_MakeFillet(solid)
    edges = TopExp_Explorer(solid, TopAbs_ShapeEnum.TopAbs_EDGE)
    while edges.More():
        edge = TopoDS.Edge(edges.Current())
        curve = BRepAdaptor_Curve(edge)
        ends = [curve.Value(t).Z() for t in (curve.FirstParameter(), curve.LastParameter())]
        if all_edges or math.isclose(*ends, abs_tol=radius * 1e-6):
            fillet.Add(radius, edge)
        edges.Next()
    fillet.Build()
    if not fillet.IsDone():
        raise NoSurfaceError(
            f"the edges of a part cannot be rounded by {radius:g}; it is too thin for a B-rep"
        )
    return fillet.Shape()
