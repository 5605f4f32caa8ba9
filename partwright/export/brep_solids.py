"""A round solid: its rounded profile turned about the axis."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from partwright.approximation.recognise import SAME
from partwright.errors import NoSurfaceError
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
    outline = _Outline(SAME * longest)
    d = f.dilation if f.dilation > outline.shortest else 0.0
    _profile(outline, corners, d, f.hollow)
    return BRepPrimAPI_MakeRevol(outline.face(), gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape()


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
    """A closed line of segments and arcs in the xz-plane."""

    def __init__(self, shortest: float) -> None:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire

        self.shortest = shortest
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

        return gp_Pnt(point[0], 0, point[1])
