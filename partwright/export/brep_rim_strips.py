"""Rims of an extrusion face by face, where OpenCASCADE makes none by itself: one along each side, between the
curves along which it meets its neighbours, up to the depth at which a side vanishes, and on without it.

Those curves are exact: lines and ellipses between straight sides, splines along the crossing of others. The
faces are the planes, cylinders, cones, tori and spheres along which the parallels of a side move.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError, ParameterError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_rim_surfaces import Place, RimAtEnd, curve_through, parallel_of, point_at
from partwright.export.brep_swept import sewn
from partwright.export.brep_topology import area_of, volume_of
from partwright.fields import Extrusion
from partwright.fields.profile_collapses import Stage, stages
from partwright.fields.profile_offset import Front, front_of, meeting
from partwright.meshing.swept_solids import extruded

if TYPE_CHECKING:
    from OCP.Geom import Geom_Curve, Geom_Surface
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Vertex, TopoDS_Wire

_REACHED = 1e-6  # of a rim's depth, that is left out at its end: a side may vanish right there
_NARROW = 1e-3  # of the profile's size: an end that is narrower is the ridge of a roof, and no face
_POINTS = 13  # of the curve along which two faces meet
_STRAIGHT = 1e-7  # of the profile's size: how far points of a curve may lie from what it is called
_SHORT = 1e-7  # of the profile's size: points that are as near are one
_CLOSED = 1e-5  # of the profile's size: how wide the gaps may be that sewing closes
_SAME_VOLUME = 3e-3  # by which the solid and its mesh may differ, which lacks that much of rims
_CHORDS = 2e-4  # of the profile's size: off that mesh


def with_strips(field: Extrusion) -> TopoDS_Shape:
    """The solid with its rims.

    Raises:
        NoSurfaceError: an end is no face, or the faces do not close.
    """
    from OCP.BRepCheck import BRepCheck_Analyzer

    size = field.profile.size
    failures: tuple[type[Exception], ...] = (*opencascade_errors(), ParameterError, ZeroDivisionError)
    try:
        solid = sewn(list(_Strips(field).faces()), _CLOSED * size)
    except failures as error:
        raise NoSurfaceError(f"the rims of an {field.kind} {field.profile} cannot be built") from error
    volume = extruded(field, _CHORDS * size).volume()
    if not BRepCheck_Analyzer(solid).IsValid() or abs(volume_of(solid) / volume - 1) > _SAME_VOLUME:
        raise NoSurfaceError(f"the rims of an {field.kind} {field.profile} enclose another volume")
    return solid


@dataclass
class _Strips:
    """The faces of one extrusion. Corners are made once, so that edges that meet share them."""

    extrusion: Extrusion
    _corners: list[tuple[np.ndarray, TopoDS_Vertex]] = field(default_factory=list)

    def faces(self) -> Iterator[TopoDS_Shape]:
        half, bottom, top = self.extrusion.height / 2, *self.extrusion.rims
        low, high = -half + bottom.depth, half - top.depth
        rings = [self._ring(front_of(sides), 0.0, low) for sides in self.extrusion.profile.sides]
        if high - low > _SHORT * self.extrusion.profile.size:
            for ring in rings:
                yield from self._walls(ring, high - low)
        yield from self._end(RimAtEnd(bottom, -1.0, half))
        yield from self._end(RimAtEnd(top, 1.0, half))

    def _end(self, rim: RimAtEnd) -> Iterator[TopoDS_Shape]:
        """The strips of the rim at an end, from the wall inwards, and the end."""
        profile, deepest = self.extrusion.profile, rim.depth * (1 - _REACHED)
        found = _apart(stages(profile, deepest), deepest) if rim.depth else []
        rings = [self._ring(front_of(sides), 0.0, rim.at(0.0)) for sides in profile.sides]
        for stage, after in pairwise(found):
            depths = stage.depth, after.depth
            above = [self._ring(front, after.depth, rim.at(after.depth)) for front in after.fronts]
            for front, low, high in zip(stage.fronts, rings, above, strict=True):
                yield from self._strips(front, low, high, depths, rim)
            rings = above
        yield self._lid(rings)

    def _ring(self, front: Front, depth: float, height: float) -> _Ring:
        """What is left of a loop so deep within, at a height."""
        joints = {pair[0]: meeting(front, *pair, depth) for pair in front.pairs()}
        edges: dict[int, TopoDS_Edge] = {}
        places: dict[int, tuple[Place, Place]] = {}
        for before, k in zip((front.left[-1], *front.left[:-1]), front.left, strict=True):
            start, end = joints[before], joints[k]
            places[k] = start, end
            if math.dist(start, end) > _SHORT * self.extrusion.profile.size:
                side = front.movers[k].side
                edges[k] = self._edge(parallel_of(side, start, end, height), start, end, height)
        for k in range(len(front.movers)):
            if k not in places:
                after = next((left for left in front.left if left > k), front.left[0])
                places[k] = places[after][0], places[after][0]
        return _Ring(places, edges, height)

    def _walls(self, ring: _Ring, height: float) -> Iterator[TopoDS_Shape]:
        from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
        from OCP.gp import gp_Vec

        for edge in ring.edges.values():
            yield BRepPrimAPI_MakePrism(edge, gp_Vec(0, 0, height)).Shape()

    def _lid(self, rings: Sequence[_Ring]) -> TopoDS_Face:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        outline, *holes = (_wire(list(ring.edges.values())) for ring in rings)
        making = BRepBuilderAPI_MakeFace(outline, True)
        for hole in holes:
            making.Add(hole)
        face = making.Face()
        length = GProp_GProps()
        BRepGProp.LinearProperties_s(outline, length)
        if area_of(face) < _NARROW * self.extrusion.profile.size * length.Mass():
            raise NoSurfaceError("the rims of an extrusion leave no end between them")
        return face

    def _strips(
        self, front: Front, ring: _Ring, above: _Ring, depths: tuple[float, float], rim: RimAtEnd
    ) -> Iterator[TopoDS_Shape]:
        """Between two rings, one along each mover of a front."""
        across = {
            k: self._curve(front, (k, after), (ring.places[k][1], above.places[k][1]), depths, rim)
            for k, after in front.pairs()
        }
        for before, k in zip((front.left[-1], *front.left[:-1]), front.left, strict=True):
            edges = [ring.edges.get(k), across[k], above.edges.get(k), across[before]]
            yield _trimmed(rim.surface(front, k), [edge for edge in edges if edge is not None])

    def _curve(
        self,
        front: Front,
        pair: tuple[int, int],
        ends: tuple[Place, Place],
        depths: tuple[float, float],
        rim: RimAtEnd,
    ) -> TopoDS_Edge:
        """Along which what two movers leave behind meets."""
        inner = rim.between(*depths, _POINTS)
        places = [ends[0], *(meeting(front, *pair, depth) for depth in inner), ends[1]]
        levels = [rim.at(depth) for depth in (depths[0], *inner, depths[1])]
        points = np.column_stack([np.array(places), levels])
        return self._between(curve_through(points, rim, _STRAIGHT * self.extrusion.profile.size), points)

    def _edge(self, curve: Geom_Curve, start: Place, end: Place, height: float) -> TopoDS_Edge:
        return self._between(curve, np.array([(*start, height), (*end, height)]))

    def _between(self, curve: Geom_Curve, points: np.ndarray) -> TopoDS_Edge:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

        making = BRepBuilderAPI_MakeEdge(curve, self._corner(points[0]), self._corner(points[-1]))
        return making.Edge()

    def _corner(self, point: np.ndarray) -> TopoDS_Vertex:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex

        for place, corner in self._corners:
            if np.abs(place - point).max() <= _SHORT * self.extrusion.profile.size:
                return corner
        corner = BRepBuilderAPI_MakeVertex(point_at(*point.tolist())).Vertex()
        self._corners.append((point, corner))
        return corner


@dataclass(frozen=True)
class _Ring:
    """Of a loop at a depth, by mover: where it begins and ends, and its edge where it has a length."""

    places: dict[int, tuple[Place, Place]]
    edges: dict[int, TopoDS_Edge]
    height: float


def _apart(found: Sequence[Stage], deepest: float) -> list[Stage]:
    """Stages that are there for a while, and what is left of the last at the deepest."""
    ends = [*(stage.depth for stage in found[1:]), deepest]
    lasting = [s for s, end in zip(found, ends, strict=True) if end - s.depth > _REACHED * deepest]
    return [*lasting, Stage(deepest, found[-1].fronts)]


def _trimmed(surface: Geom_Surface, edges: list[TopoDS_Edge]) -> TopoDS_Shape:
    """What of a surface lies within a closed line of edges: less than what lies outside of it, where the
    surface closes in itself."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.ShapeFix import ShapeFix_Shape
    from OCP.TopoDS import TopoDS

    wire, sides = _wire(edges), []
    for one in (wire, TopoDS.Wire(wire.Reversed())):
        fixing = ShapeFix_Shape(BRepBuilderAPI_MakeFace(surface, one, True).Face())
        fixing.Perform()
        sides.append(fixing.Shape())
    return min(sides, key=area_of)


def _wire(edges: Sequence[TopoDS_Edge]) -> TopoDS_Wire:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeWire

    wire = BRepBuilderAPI_MakeWire()
    for edge in edges:
        wire.Add(edge)
    return wire.Wire()
