"""Exact solids of profiles swept around rounded rectangles: every straight SuperFrustum, and its bent ends.

A line or arc of the profile becomes a plane or cylinder along each side and a cone, cylinder, torus or sphere
around each corner; below a corner radius of 0 the sides meet in a mitre. All faces are analytic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from partwright.errors import NoSurfaceError
from partwright.export.brep_profile import Arc, Edge, Outline, Point, pieces
from partwright.export.brep_topology import faces_of

if TYPE_CHECKING:
    from OCP.gp import gp_Pnt
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape

# quarter turns -> the side whose outward normal points there; a corner follows each side
_SIDES = (0, 1, 2, 3)


@dataclass(frozen=True)
class Sweep:
    """half_x, half_y: of the rectangle of the corners' axes. shortest: lengths below it are none."""

    half_x: float
    half_y: float
    shortest: float

    def solid(self, outline: Outline) -> TopoDS_Shape:
        """What lies within the outline, flat at its two ends.

        Raises:
            NoSurfaceError: its faces do not close.
        """
        return sewn(list(self.faces(outline)), self.shortest / 10)

    def section(self, rho: float, z: float) -> TopoDS_Face:
        """The rounded rectangle at this height."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

        return BRepBuilderAPI_MakeFace(self.section_wire(rho, z), True).Face()

    def section_wire(self, rho: float, z: float) -> Any:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire

        wire = BRepBuilderAPI_MakeWire()
        for side in _SIDES:
            for edge in self._section_edges(side, rho, z):
                wire.Add(edge)
        return wire.Wire()

    def _section_edges(self, side: int, rho: float, z: float) -> Iterator[TopoDS_Edge]:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
        from OCP.GC import GC_MakeArcOfCircle

        half = self._half(side) + min(rho, 0.0)
        if half > self.shortest / 2:
            ends = [self._place(side, rho, along, z) for along in (-half, half)]
            yield BRepBuilderAPI_MakeEdge(*ends).Edge()
        if rho > self.shortest:
            axis, across = self._half(side), self._half(side + 1)
            base, turn = math.pi / 2 * side, math.pi / 4
            points = []
            for step in (0, 1, 2):
                angle = step * turn
                local = (across + rho * math.cos(angle), axis + rho * math.sin(angle))
                points.append(_turned(local, base, z))
            yield BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(*points).Value()).Edge()

    def faces(self, outline: Outline, bottom: bool = True, top: bool = True) -> Iterator[TopoDS_Shape]:
        """Of what lies within the outline; bottom, top: whether with these flat ends."""
        for edge in pieces(outline, rho=0.0):
            if math.dist(edge.start, edge.end) <= self.shortest:
                continue
            sharp = min(edge.start[0], edge.end[0]) < -self.shortest / 100
            for side in _SIDES:
                yield from self._mitred(side, edge) if sharp else self._rounded(side, edge)
        for wanted, (rho, z) in ((bottom, outline[0].start), (top, outline[-1].end)):
            if wanted and min(self.half_x, self.half_y) + rho > self.shortest / 2:
                yield self.section(rho, z)

    def _rounded(self, side: int, edge: Edge) -> Iterator[TopoDS_Shape]:
        """The face along the side, and that around the corner after it."""
        from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
        from OCP.gp import gp_Ax1, gp_Dir, gp_Vec

        half = self._half(side)
        if half > self.shortest / 2:
            along = _turned((0.0, 2 * half), math.pi / 2 * side, 0.0)
            yield BRepPrimAPI_MakePrism(
                self._edge(side, edge, -half), gp_Vec(along.X(), along.Y(), 0)
            ).Shape()
        corner = _turned((self._half(side + 1), half), math.pi / 2 * side, 0.0)
        axis = gp_Ax1(corner, gp_Dir(0, 0, 1))
        yield BRepPrimAPI_MakeRevol(self._edge(side, edge, half), axis, math.pi / 2).Shape()

    def _mitred(self, side: int, edge: Edge) -> Iterator[TopoDS_Shape]:
        """The face along the side, cut off by the planes through its corners' axes."""
        from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
        from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
        from OCP.gp import gp_Vec

        half = self._half(side)
        if not isinstance(edge, Arc):
            corners: list[gp_Pnt] = []
            for (rho, z), turn in ((edge.start, (-1, 1)), (edge.end, (1, -1))):
                corners += [self._place(side, rho, sign * (half + rho), z) for sign in turn]
            kept = [p for i, p in enumerate(corners) if p.Distance(corners[i - 1]) > self.shortest]
            if len(kept) > 2:
                polygon = BRepBuilderAPI_MakePolygon()
                for point in kept:
                    polygon.Add(point)
                polygon.Close()
                yield BRepBuilderAPI_MakeFace(polygon.Wire(), True).Face()
            return
        along = _turned((0.0, 2 * half), math.pi / 2 * side, 0.0)
        whole = BRepPrimAPI_MakePrism(self._edge(side, edge, -half), gp_Vec(along.X(), along.Y(), 0)).Shape()
        low, high = edge.centre[1] - 2 * edge.radius, edge.centre[1] + 2 * edge.radius
        reach = min(half, self._half(side + 1))
        wedge = BRepBuilderAPI_MakePolygon()
        for rho, sign in ((0.0, -1), (0.0, 1), (-reach, 1), (-reach, -1)):
            if rho == 0.0 or sign > 0 or half - reach > self.shortest:
                wedge.Add(self._place(side, rho, sign * (half + rho), low))
        wedge.Close()
        room = BRepPrimAPI_MakePrism(
            BRepBuilderAPI_MakeFace(wedge.Wire(), True).Face(), gp_Vec(0, 0, high - low)
        )
        yield from faces_of(BRepAlgoAPI_Common(whole, room.Shape()).Shape())

    def _edge(self, side: int, edge: Edge, along: float) -> TopoDS_Edge:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
        from OCP.GC import GC_MakeArcOfCircle

        def place(point: Point) -> gp_Pnt:
            return self._place(side, point[0], along, point[1])

        if not isinstance(edge, Arc):
            return BRepBuilderAPI_MakeEdge(place(edge.start), place(edge.end)).Edge()
        middle = edge.at((edge.first + edge.last) / 2)
        arc = GC_MakeArcOfCircle(place(edge.start), place(middle), place(edge.end)).Value()
        return BRepBuilderAPI_MakeEdge(arc).Edge()

    def _half(self, side: int) -> float:
        """Half the length of a side: those that face along x run along y."""
        return self.half_x if side % 2 else self.half_y

    def _place(self, side: int, rho: float, along: float, z: float) -> gp_Pnt:
        return _turned((self._half(side + 1) + rho, along), math.pi / 2 * side, z)


def sewn(faces: list[TopoDS_Shape], tolerance: float) -> TopoDS_Shape:
    """The solid within the faces.

    Raises:
        NoSurfaceError: they do not close.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid, BRepBuilderAPI_Sewing
    from OCP.BRepLib import BRepLib
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    sewing = BRepBuilderAPI_Sewing(max(1e-7, tolerance))
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    shell = sewing.SewedShape()
    if shell.IsNull() or shell.ShapeType() != TopAbs_ShapeEnum.TopAbs_SHELL or sewing.NbFreeEdges():
        raise NoSurfaceError("the faces of a part do not close; it is too thin for a B-rep")
    solid = BRepBuilderAPI_MakeSolid(TopoDS.Shell(shell)).Solid()
    BRepLib.OrientClosedSolid_s(solid)
    unify = ShapeUpgrade_UnifySameDomain(solid, True, True, False)
    unify.Build()
    return unify.Shape()


def _turned(point: Point, angle: float, z: float) -> gp_Pnt:
    from OCP.gp import gp_Pnt

    c, s = round(math.cos(angle)), round(math.sin(angle))
    return gp_Pnt(c * point[0] - s * point[1], s * point[0] + c * point[1], z)
