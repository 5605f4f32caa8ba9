"""Extrusions and revolutions as exact B-rep solids: lines become planes, cones or cylinders, arcs cylinders,
cones, spheres or tori."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from partwright.errors import NoSurfaceError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_rims import with_rims
from partwright.export.brep_swept import sewn
from partwright.export.brep_topology import solids_of
from partwright.fields import Extrusion, Profile, Revolution, Swept
from partwright.fields.profile import Loop, Side, circle_of
from partwright.fields.profile_offset import Wall

if TYPE_CHECKING:
    from collections.abc import Callable

    from OCP.gp import gp_Pnt
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Wire

Place = tuple[float, float]
_SPHERE = 1e-9  # of an arc's radius: its centre's distance from the axis, at which it turns into a sphere


def swept_profile(field: Swept) -> TopoDS_Shape:
    """The field as a solid in its own frame.

    Raises:
        NoSurfaceError: OpenCASCADE cannot build it.
    """
    try:
        if isinstance(field, Revolution):
            return _revolved(field)
        assert isinstance(field, Extrusion)
        return _tapered(field) if field.taper else _extruded(field)
    except opencascade_errors() as error:
        raise NoSurfaceError(f"OpenCASCADE cannot build an {field.kind} {field.profile}") from error


def has_common_rims(field: Extrusion) -> bool:
    """Whether OpenCASCADE's own fillets and chamfers make its rims, as CAD programs that build on it do."""
    return with_rims(field, *_upright(field)).common


def _extruded(field: Extrusion) -> TopoDS_Shape:
    solid, bottom, top = _upright(field)
    return _oriented(with_rims(field, solid, bottom, top).solid) if field.has_rims else solid


def _upright(field: Extrusion) -> tuple[TopoDS_Shape, TopoDS_Shape, TopoDS_Shape]:
    """The solid without its rims, and its faces at the bottom and the top."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec

    base = _face(field.profile, _level(-field.height / 2))
    prism = BRepPrimAPI_MakePrism(base, gp_Vec(0, 0, field.height))
    return _oriented(prism.Shape()), prism.FirstShape(), prism.LastShape()


def _revolved(field: Revolution) -> TopoDS_Shape:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    def upright(x: float, y: float) -> gp_Pnt:
        return gp_Pnt(x, 0.0, y)

    axis, face = gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), _face(field.profile, upright, turned=True)
    turned = (
        BRepPrimAPI_MakeRevol(face, axis)
        if field.full
        else BRepPrimAPI_MakeRevol(face, axis, math.radians(field.angle))
    )
    return _oriented(turned.Shape())


def _oriented(shape: TopoDS_Shape) -> TopoDS_Shape:
    """Right side out."""
    from OCP.BRepLib import BRepLib

    solid = next(solids_of(shape))
    BRepLib.OrientClosedSolid_s(solid)
    return solid


def _level(z: float) -> Callable[[float, float], gp_Pnt]:
    from OCP.gp import gp_Pnt

    return lambda x, y: gp_Pnt(x, y, z)


def _face(profile: Profile, at: Callable[[float, float], gp_Pnt], turned: bool = False) -> TopoDS_Face:
    """The profile as a plane face; at: where a point of it lies; turned: it is to be, about x = 0."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace

    outline, *holes = (
        _wire(loop, sides, at, turned) for loop, sides in zip(profile.loops, profile.sides, strict=True)
    )
    face = BRepBuilderAPI_MakeFace(outline, True)
    for hole in holes:
        face.Add(hole)
    return face.Face()


def _wire(
    loop: Loop, sides: tuple[Side, ...], at: Callable[[float, float], gp_Pnt], turned: bool
) -> TopoDS_Wire:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire

    wire = BRepBuilderAPI_MakeWire()
    found = circle_of(loop)
    if found is not None:  # as one edge, so that one face comes of it
        wire.Add(_circle(*found, loop, at))
        return wire.Wire()
    for side in sides:
        wire.Add(_edge(side, at, turned and _crosses_itself(side)))
    return wire.Wire()


def _circle(radius: float, centre: Place, loop: Loop, at: Callable[[float, float], gp_Pnt]) -> TopoDS_Edge:
    """A full circle through the loop's first corner, in its direction."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Vec

    (x, y), (sx, sy, bulge) = centre, loop[0]
    middle, start = at(x, y), at(sx, sy)
    turn = 1.0 if bulge > 0 else -1.0
    ahead, across = gp_Vec(middle, start), gp_Vec(middle, at(x - turn * (sy - y), y + turn * (sx - x)))
    axes = gp_Ax2(middle, gp_Dir(ahead.Crossed(across)), gp_Dir(ahead))
    return BRepBuilderAPI_MakeEdge(gp_Circ(axes, radius)).Edge()


def _crosses_itself(side: Side) -> bool:
    """Whether the whole circle of an arc does when it is turned about x = 0, as a spindle torus."""
    return side.centre is not None and _SPHERE * side.radius < abs(side.centre[0]) < side.radius


def _edge(side: Side, at: Callable[[float, float], gp_Pnt], of_its_own: bool = False) -> TopoDS_Edge:
    """A line or an arc; of_its_own: the arc's curve ends where the arc does, rather than be a whole circle.

    Readers of STEP take points on a surface that crosses itself for others."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.GeomConvert import GeomConvert

    start, end = at(*side.start), at(*side.end)
    if side.centre is None:
        return BRepBuilderAPI_MakeEdge(start, end).Edge()
    arc = GC_MakeArcOfCircle(start, at(*side.middle), end).Value()
    return BRepBuilderAPI_MakeEdge(GeomConvert.CurveToBSplineCurve_s(arc) if of_its_own else arc).Edge()


def _tapered(field: Extrusion) -> TopoDS_Shape:
    half = field.height / 2
    faces: list[TopoDS_Shape] = [_face(field.profile, _level(-half)), _face(field.top, _level(half))]
    faces += [_leaning(wall, half) for loop in field.walls for wall in loop]
    return sewn(faces, 1e-7 * field.profile.size)


def _leaning(wall: Wall, half: float) -> TopoDS_Shape:
    """A side's wall: a plane over a line, a cone over an arc."""
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
    )
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    low, high = _level(-half), _level(half)
    if wall.above.centre is None:
        assert wall.below is not None
        corners = (
            low(*wall.below.start),
            low(*wall.below.end),
            high(*wall.above.end),
            high(*wall.above.start),
        )
        return BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakePolygon(*corners, True).Wire(), True).Face()
    x, y = wall.above.centre
    up = 1.0 if wall.above.sweep > 0 else -1.0
    line = BRepBuilderAPI_MakeEdge(low(*wall.start), high(*wall.above.start)).Edge()
    axis = gp_Ax1(gp_Pnt(x, y, 0), gp_Dir(0, 0, up))
    return BRepPrimAPI_MakeRevol(line, axis, abs(wall.above.sweep)).Shape()
