"""The surfaces along which rims of an extrusion run, and the curves along which two of them meet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.fields.profile import Side
from partwright.fields.profile_offset import Front
from partwright.fields.rims import Rim

if TYPE_CHECKING:
    from OCP.Geom import Geom_Curve, Geom_Surface
    from OCP.gp import gp_Pnt

Place = tuple[float, float]
_SPHERE = 1e-9  # of a rim's depth: an arc that is as round as it turns into a sphere


@dataclass(frozen=True)
class RimAtEnd:
    """A rim at the end at sign * half."""

    rim: Rim
    sign: float
    half: float

    @property
    def depth(self) -> float:
        return self.rim.depth

    def at(self, depth: float) -> float:
        """The height of what is so deep within the profile."""
        return self.sign * (self.half - self.rim.step_at(min(depth, self.rim.depth))[1])

    def between(self, low: float, high: float, count: int) -> list[float]:
        """Depths, in equal steps along the rim, without both ends."""
        shares = [k / (count + 1) for k in range(1, count + 1)]
        if not self.rim.fillet:
            return [low + share * (high - low) for share in shares]
        first, last = (math.acos(max(1 - depth / self.rim.fillet, -1.0)) for depth in (low, high))
        turns = (first + share * (last - first) for share in shares)
        return [self.rim.fillet * (1 - math.cos(turn)) for turn in turns]

    def surface(self, front: Front, k: int) -> Geom_Surface:
        """What the parallels of a mover sweep on their way in."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
        from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism, BRepPrimAPI_MakeRevol
        from OCP.gp import gp_Ax1, gp_Dir, gp_Vec
        from OCP.TopoDS import TopoDS

        side, depth = front.movers[k].side, self.rim.depth
        if side.centre is None:
            way, inwards = side.direction(), _left(side.direction())
            edge = BRepBuilderAPI_MakeEdge(self._meridian(np.array(side.start), inwards, depth)).Edge()
            swept = BRepPrimAPI_MakePrism(edge, gp_Vec(*way.tolist(), 0)).Shape()
        else:
            turn, centre = math.copysign(1.0, side.sweep), np.array(side.centre)
            away = _away(front, k)
            if turn > 0 and abs(side.radius - self.rim.fillet) <= _SPHERE * depth:
                return self._ball(centre, away)
            reach = min(depth, side.radius) if turn > 0 else depth
            curve = self._meridian(centre + side.radius * away, -turn * away, reach)
            if self.rim.fillet:
                curve = _of_its_own(curve, side.radius - turn * depth, depth)
            axis = gp_Ax1(point_at(*side.centre, 0.0), gp_Dir(0, 0, 1))
            swept = BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeEdge(curve).Edge(), axis).Shape()
        return BRep_Tool.Surface_s(TopoDS.Face(swept))

    def _ball(self, centre: np.ndarray, away: np.ndarray) -> Geom_Surface:
        """Its poles and its seam lie beside and behind what is seen of it."""
        from OCP.Geom import Geom_SphericalSurface
        from OCP.gp import gp_Ax3, gp_Dir

        across, back = gp_Dir(*_left(away).tolist(), 0.0), gp_Dir(*away.tolist(), 0.0)
        x, y = centre.tolist()
        middle = point_at(x, y, self.sign * (self.half - self.rim.fillet))
        return Geom_SphericalSurface(gp_Ax3(middle, across, back), self.rim.fillet)

    def _meridian(self, start: np.ndarray, inwards: np.ndarray, reach: float) -> Geom_Curve:
        """Across the rim, as deep as it reaches, from a place on the profile."""
        from OCP.GC import GC_MakeArcOfCircle, GC_MakeSegment

        def at(depth: float) -> gp_Pnt:
            x, y = (start + depth * inwards).tolist()
            return point_at(x, y, self.at(depth))

        if not self.rim.fillet:
            return GC_MakeSegment(at(0.0), at(reach)).Value()
        half = math.acos(max(1 - reach / self.rim.fillet, 0.0)) / 2
        return GC_MakeArcOfCircle(at(0.0), at(self.rim.fillet * (1 - math.cos(half))), at(reach)).Value()


def _away(front: Front, k: int) -> np.ndarray:
    """(2,) unit, from the middle of a mover's arc to its centre and on: there a surface that is turned has
    its seam, behind what the arc sweeps."""
    side, half = front.movers[k].side, front.movers[k].side.sweep / 2
    if front.movers[k].below is None:  # about the corner where the next begins
        (x, y), half = front.movers[(k + 1) % len(front.movers)].side.direction(), -half
    else:
        x, y = side.direction()
    c, s = math.cos(half), math.sin(half)
    return math.copysign(1.0, side.sweep) * _left(np.array([c * x - s * y, s * x + c * y]))


def _of_its_own(curve: Geom_Curve, middle: float, radius: float) -> Geom_Curve:
    """An arc that ends where it does, rather than a whole circle, where that crosses the axis, so far from
    its middle: readers of STEP take points on a surface that crosses itself for others."""
    from OCP.GeomConvert import GeomConvert

    if abs(middle) <= _SPHERE * radius or middle > radius * (1 + _SPHERE):
        return curve
    return GeomConvert.CurveToBSplineCurve_s(curve)


def parallel_of(side: Side, start: Place, end: Place, height: float) -> Geom_Curve:
    """Of a side, between two points of it."""
    from OCP.GC import GC_MakeArcOfCircle, GC_MakeSegment

    first, last = point_at(*start, height), point_at(*end, height)
    if side.centre is None:
        return GC_MakeSegment(first, last).Value()
    a, b = (np.subtract(place, side.centre) for place in (start, end))
    sweep = math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)
    half = (side.sweep + math.remainder(sweep - side.sweep, 2 * math.pi)) / 2
    c, s = math.cos(half), math.sin(half)
    x, y = side.centre[0] + c * a[0] - s * a[1], side.centre[1] + s * a[0] + c * a[1]
    return GC_MakeArcOfCircle(first, point_at(x, y, height), last).Value()


def curve_through(points: np.ndarray, rim: RimAtEnd, within: float) -> Geom_Curve:
    """A line, an arc of an ellipse or a spline through points (N, 3)."""
    from OCP.collections import HArray1_gp_Pnt
    from OCP.GC import GC_MakeSegment
    from OCP.GeomAPI import GeomAPI_Interpolate

    flat = points[:, :2] - points[0, :2]
    length = float(np.linalg.norm(flat[-1]))
    if length <= within:
        raise NoSurfaceError("the rims of an extrusion do not go inwards")
    way = flat[-1] / length
    if np.abs(flat @ _left(way)).max() <= within:
        if not rim.rim.fillet:
            return GC_MakeSegment(point_at(*points[0].tolist()), point_at(*points[-1].tolist())).Value()
        ellipse = _ellipse(points, way, rim, within)
        if ellipse is not None:
            return ellipse
    given = HArray1_gp_Pnt(1, len(points))
    for k, point in enumerate(points.tolist(), start=1):
        given.SetValue(k, point_at(*point))
    making = GeomAPI_Interpolate(given, False, within)
    making.Perform()
    if not making.IsDone():
        raise NoSurfaceError("the rims of an extrusion meet in no curve")
    return making.Curve()


def _ellipse(points: np.ndarray, way: np.ndarray, rim: RimAtEnd, within: float) -> Geom_Curve | None:
    """Through points above a straight way of which each is as far as it is deep, times a number."""
    from OCP.GC import GC_MakeArcOfCircle, GC_MakeArcOfEllipse
    from OCP.gp import gp_Ax2, gp_Dir, gp_Elips

    radius = rim.rim.fillet
    along, up = (points[:, :2] - points[0, :2]) @ way, points[:, 2]
    height = rim.sign * (rim.half - radius)
    # How deep each is, by its height: radius (1 - cos t) at height + sign * radius * sin t.
    rise = np.clip(np.abs(up - height) / radius, 0.0, 1.0)
    deep = radius * (1 - np.sqrt(1 - rise**2))
    if deep[-1] - deep[0] <= within:
        return None
    stretch = float((along[-1] - along[0]) / (deep[-1] - deep[0]))
    if stretch < 1 - 1e-9 or np.abs(along - stretch * (deep - deep[0])).max() > within:
        return None
    first, middle, last = (point_at(*points[k].tolist()) for k in (0, len(points) // 2, -1))
    if stretch < 1 + 1e-9:
        return GC_MakeArcOfCircle(first, middle, last).Value()
    x, y = (points[0, :2] + stretch * (radius - deep[0]) * way).tolist()
    across = gp_Dir(way[1], -way[0], 0.0)
    axes = gp_Ax2(point_at(x, y, height), across, gp_Dir(way[0], way[1], 0.0))
    ellipse = gp_Elips(axes, stretch * radius, radius)
    for sense in (True, False):
        arc = GC_MakeArcOfEllipse(ellipse, first, last, sense).Value()
        if _passes(arc, points[len(points) // 2], 10 * within):
            return arc
    return None


def _passes(curve: Geom_Curve, point: np.ndarray, within: float) -> bool:
    from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve

    near = GeomAPI_ProjectPointOnCurve(point_at(*point.tolist()), curve)
    return near.NbPoints() > 0 and near.LowerDistance() <= within


def _left(way: np.ndarray) -> np.ndarray:
    return np.array([-way[1], way[0]])


def point_at(x: float, y: float, z: float) -> gp_Pnt:
    from OCP.gp import gp_Pnt

    return gp_Pnt(x, y, z)
