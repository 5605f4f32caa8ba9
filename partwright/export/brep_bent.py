"""Bent SuperFrusta: the sweep between the ends of the arc, and beyond them the straight rims of the dilation.

Without taper the middle is the cross-section turned about the arc's axis: planes, cylinders and tori. With
taper it is a surface through cross-sections, which only they lie on exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from partwright.errors import NoSurfaceError
from partwright.export.brep_profile import Line, Outline, Point, pieces
from partwright.export.brep_swept import Sweep, sewn

if TYPE_CHECKING:
    from OCP.gp import gp_Trsf
    from OCP.TopoDS import TopoDS_Shape

_SECTIONS = 13


def bent_solid(sweep: Sweep, outline: Outline, half_height: float, angle: float) -> TopoDS_Shape:
    """What lies within the outline, along an arc of this half angle and half chord towards -x.

    Raises:
        NoSurfaceError: the arc's centre is inside, so that the bend folds over itself.
    """
    h, radius = half_height, half_height / math.sin(angle)
    widest = sweep.half_x + max(max(edge.start[0], edge.end[0]) for edge in outline)
    if widest >= radius:
        raise NoSurfaceError("a part bends about a centre within itself, which no B-rep can follow")
    parts: list[Outline] = [[], [], []]
    for edge in (cut for piece in pieces(outline, z=-h) for cut in pieces([piece], z=h)):
        z = (edge.start[1] + edge.end[1]) / 2
        if math.dist(edge.start, edge.end) > sweep.shortest:
            parts[0 if z < -h else 2 if z > h else 1].append(edge)
    low, middle, high = parts
    faces = list(_bent(sweep, middle, h, radius, angle))
    for end, side, before in ((low, -1.0, middle[0].start), (high, 1.0, middle[-1].end)):
        pose = _location(_at_end(side * h, side * angle))
        rim = sweep.faces(end, side < 0, side > 0) if end else _flat(sweep, before)
        faces += [face.Moved(pose) for face in rim]
    return sewn(faces, 20 * sweep.shortest)


def _flat(sweep: Sweep, end: Point) -> Iterator[TopoDS_Shape]:
    if min(sweep.half_x, sweep.half_y) + end[0] > sweep.shortest / 2:
        yield sweep.section(*end)


def _bent(sweep: Sweep, outline: Outline, h: float, radius: float, angle: float) -> Iterator[TopoDS_Shape]:
    """The faces between the ends of the arc."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    first, last = outline[0].start, outline[-1].end
    straight = len(outline) == 1 and isinstance(outline[0], Line)
    if not straight or abs(first[0] - last[0]) > sweep.shortest:
        yield _lofted(sweep, outline, h, radius, angle)
        return
    section = sweep.section_wire(first[0], 0.0).Moved(_location(_along(-h, h, radius, angle)))
    axis = gp_Ax1(gp_Pnt(h / math.tan(angle), 0, 0), gp_Dir(0, 1, 0))
    yield BRepPrimAPI_MakeRevol(section, axis, 2 * angle).Shape()


def _lofted(sweep: Sweep, outline: Outline, h: float, radius: float, angle: float) -> TopoDS_Shape:
    """The shell through cross-sections. Where some have round corners all do, if only by a hair."""
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.TopoDS import TopoDS

    low, high = outline[0].start[1], outline[-1].end[1]
    levels = [low + (high - low) * i / (_SECTIONS - 1) for i in range(_SECTIONS)]
    widths = [_width(outline, z) for z in levels]
    narrowest = min(sweep.half_x, sweep.half_y)
    least = 5 * sweep.shortest if max(widths) > sweep.shortest else -math.inf
    loft = BRepOffsetAPI_ThruSections(False, False, sweep.shortest)
    for z, rho in zip(levels, widths, strict=True):
        width = max(rho, 10 * sweep.shortest - narrowest)  # no section runs through a tip or an edge
        shrunk = min(width - least, 0.0) if least > 0 else 0.0
        own = Sweep(sweep.half_x + shrunk, sweep.half_y + shrunk, sweep.shortest)
        wire = own.section_wire(max(width, least), 0.0).Moved(_location(_along(z, h, radius, angle)))
        loft.AddWire(TopoDS.Wire(wire))
    loft.Build()
    if not loft.IsDone():
        raise NoSurfaceError("a bent part's surface cannot be built; it is too thin for a B-rep")
    return loft.Shape()


def _width(outline: Outline, z: float) -> float:
    """The outline's rho at this height."""
    for edge in outline:
        (a, low), (b, high) = edge.start, edge.end
        if low <= z <= high or edge is outline[-1]:
            if isinstance(edge, Line):
                return a + (b - a) * (z - low) / (high - low)
            side = 1.0 if math.cos((edge.first + edge.last) / 2) > 0 else -1.0
            level = min(max((z - edge.centre[1]) / edge.radius, -1.0), 1.0)
            return edge.centre[0] + side * edge.radius * math.sqrt(1 - level * level)
    raise AssertionError("an outline has edges")


def _along(z: float, h: float, radius: float, angle: float) -> gp_Trsf:
    """From the plane z = 0 to that across the arc where its own coordinate is z."""
    turn = z * angle / h
    return _rotation(turn, (radius * (math.cos(angle) - math.cos(turn)), radius * math.sin(turn)))


def _at_end(z: float, turn: float) -> gp_Trsf:
    """Turns about the arc's end, where the straight solid's axis passes (0, 0, z)."""
    return _rotation(turn, (-z * math.sin(turn), z - z * math.cos(turn)))


def _rotation(turn: float, place: Point) -> gp_Trsf:
    from OCP.gp import gp_Quaternion, gp_Trsf, gp_Vec

    pose = gp_Trsf()
    pose.SetRotation(gp_Quaternion(gp_Vec(0, 1, 0), turn))
    pose.SetTranslationPart(gp_Vec(place[0], 0, place[1]))
    return pose


def _location(pose: gp_Trsf):  # type: ignore[no-untyped-def]  # a TopLoc_Location
    from OCP.TopLoc import TopLoc_Location

    return TopLoc_Location(pose)
