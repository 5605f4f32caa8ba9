"""Rims of an extrusion where OpenCASCADE makes none by itself, as where sides vanish along them:
what they take away, side by side, is cut from the upright solid.

Along a line that is a prism, along an arc it is turned, and about a corner that turns inwards as well. It
reaches as far as a side's nearest points do, so that what two of them have in common ends in their mitre.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from partwright.export.brep_booleans import Repairs, operated
from partwright.fields import Extrusion
from partwright.fields.profile_offset import Mover, front_of
from partwright.fields.rims import Rim
from partwright.meshing.swept_solids import extruded

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Face, TopoDS_Shape

_CHORDS = 2e-4  # of the profile's size: off the mesh that tells the volume


def with_cut_rims(field: Extrusion, solid: TopoDS_Shape) -> TopoDS_Shape:
    """The upright solid with its rims.

    Raises:
        NoSurfaceError: OpenCASCADE cannot cut them.
    """
    cuts = [cut for upwards in (False, True) for cut in _cuts(field, upwards)]
    volume = extruded(field, _CHORDS * field.profile.size).volume()
    label = f"the rims of an {field.kind} {field.profile}"
    return operated("difference", [solid, *cuts], volume, label, Repairs())


def _cuts(field: Extrusion, upwards: bool) -> Iterator[TopoDS_Shape]:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec

    rim, end = field.rims[upwards], (field.height / 2 if upwards else -field.height / 2)
    for sides in field.profile.sides if rim.depth else ():
        movers = front_of(sides).movers
        for before, mover in zip((movers[-1], *movers), movers, strict=False):
            side, section = mover.side, _section(rim, mover, before, end)
            if side.centre is None:
                (ax, ay), (bx, by) = side.start, side.end
                yield BRepPrimAPI_MakePrism(section, gp_Vec(bx - ax, by - ay, 0)).Shape()
            else:
                axis = gp_Ax1(gp_Pnt(*side.centre, 0), gp_Dir(0, 0, math.copysign(1, side.sweep)))
                yield BRepPrimAPI_MakeRevol(section, axis, abs(side.sweep)).Shape()


def _section(rim: Rim, mover: Mover, before: Mover, end: float) -> TopoDS_Face:
    """What lies beyond the rim at a side's start, as deep as the side's nearest points lie, and above the
    end."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.gp import gp_Pnt

    side = mover.side
    way = side.direction() if mover.below is not None else before.side.direction(at_end=True)
    inwards = np.array([-way[1], way[0]])

    def at(deep: float, off: float) -> gp_Pnt:
        x, y = (side.start + deep * inwards).tolist()
        return gp_Pnt(x, y, end - off if end > 0 else end + off)

    reach = min(rim.depth, side.radius) if side.sweep > 0 else rim.depth
    low, high = (0.0, rim.depth), rim.step_at(reach)
    wire = BRepBuilderAPI_MakeWire()
    if rim.fillet:
        half = math.acos(1 - reach / rim.fillet) / 2
        middle = rim.fillet * (1 - math.cos(half)), rim.fillet * (1 - math.sin(half))
        arc = GC_MakeArcOfCircle(at(*low), at(*middle), at(*high)).Value()
        wire.Add(BRepBuilderAPI_MakeEdge(arc).Edge())
    else:
        wire.Add(BRepBuilderAPI_MakeEdge(at(*low), at(*high)).Edge())
    for pair in pairwise([high, (reach, -rim.depth), (0.0, -rim.depth), low]):
        wire.Add(BRepBuilderAPI_MakeEdge(*(at(*place) for place in pair)).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()
