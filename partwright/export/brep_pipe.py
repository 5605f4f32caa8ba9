"""Pipes as exact B-rep solids: cylinders along runs, tori at bends, planes at the ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_swept import sewn
from partwright.export.brep_topology import volume_and_area
from partwright.fields import Pipe
from partwright.fields.bent_path import Run, perpendicular

if TYPE_CHECKING:
    from collections.abc import Iterator

    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape

_SEWN = 1e-7  # of the radius: how far apart edges of pieces may lie that are to be one
_SAME_VOLUME = 1e-6  # share by which the volume may be off: it is known, and all faces are exact


def pipe_solid(field: Pipe) -> TopoDS_Shape:
    """The pipe in its own frame: the faces of each piece of its path, sewn.

    Raises:
        NoSurfaceError: OpenCASCADE cannot build it.
    """
    from OCP.BRepCheck import BRepCheck_Analyzer

    radii = [field.radius, *([field.bore] if field.bore else [])]
    try:
        shape = sewn(list(_faces(field, radii)), _SEWN * field.radius)
        volume = math.pi * (field.radius**2 - field.bore**2) * field.length  # by Pappus
        off = abs(volume_and_area(shape)[0] / volume - 1)
        valid = BRepCheck_Analyzer(shape).IsValid()
    except opencascade_errors() as error:
        raise NoSurfaceError("OpenCASCADE cannot build a pipe") from error
    if off > _SAME_VOLUME or not valid:
        raise NoSurfaceError("OpenCASCADE fails at a pipe; give it wider bends or longer runs")
    return shape


def _faces(field: Pipe, radii: list[float]) -> Iterator[TopoDS_Shape]:
    """The walls, piece by piece, between the flat ends. Where pieces meet so do their seams: sewing does not
    join circles that begin elsewhere."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Vec

    (start, out), last = field.ends
    seam = perpendicular(-out)
    yield _end(start, -out, seam, radii)
    for piece in field.pieces:
        begin = np.zeros(1)
        circles = [_circle(piece.at(begin)[0], piece.directions(begin)[0], seam, radius) for radius in radii]
        if isinstance(piece, Run):
            along = gp_Vec(*(piece.end - piece.start))
            yield from (BRepPrimAPI_MakePrism(circle, along).Shape() for circle in circles)
        else:
            axis = gp_Ax1(gp_Pnt(*piece.centre), gp_Dir(*piece.axis))
            yield from (BRepPrimAPI_MakeRevol(circle, axis, piece.angle).Shape() for circle in circles)
            seam = piece.turned(seam)
    yield _end(*last, seam, radii)


def _end(place: np.ndarray, along: np.ndarray, seam: np.ndarray, radii: list[float]) -> TopoDS_Face:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.TopoDS import TopoDS

    outer, *inner = (BRepBuilderAPI_MakeWire(_circle(place, along, seam, r)).Wire() for r in radii)
    face = BRepBuilderAPI_MakeFace(outer, True)
    for hole in inner:
        face.Add(TopoDS.Wire(hole.Reversed()))
    return face.Face()


def _circle(place: np.ndarray, along: np.ndarray, seam: np.ndarray, radius: float) -> TopoDS_Edge:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt

    axes = gp_Ax2(gp_Pnt(*place), gp_Dir(*along), gp_Dir(*seam))
    return BRepBuilderAPI_MakeEdge(gp_Circ(axes, radius)).Edge()
