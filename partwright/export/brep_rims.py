"""Fillets and chamfers at the ends of an extrusion, as the faces that a CAD program makes: cylinders, tori
and spheres along a fillet, planes and cones along a chamfer.

About a sharp corner that points inwards they meet in a mitre, where the field's run in an arc.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from partwright.errors import NoSurfaceError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_rim_cuts import with_cut_rims
from partwright.export.brep_rim_strips import with_strips
from partwright.export.brep_topology import edges_of, faces_of
from partwright.fields import Extrusion, Swept
from partwright.fields.extrusion import RIMS
from partwright.fields.rims import Rim

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_SHARES = (1.0, 1 - 1e-5)
"""Of a rim's depth: where two rims meet, or one takes all of a side, OpenCASCADE wants something left. As
little as this counts as nothing, here and where solids are recognised."""
_SHALLOW = 1e-3  # of its depth, by which a rim may be less deep and say so
SHALLOW = "its fillets and chamfers are a thousandth less deep: OpenCASCADE builds no others"


class Rimmed(NamedTuple):
    """A solid with its rims. common: whether they are those that OpenCASCADE, and CAD programs that build on
    it, make by themselves."""

    solid: TopoDS_Shape
    common: bool


def with_rims(field: Extrusion, solid: TopoDS_Shape, bottom: TopoDS_Shape, top: TopoDS_Shape) -> Rimmed:
    """The solid with its rims as CAD programs make them; face by face where these make none, or leave a patch
    that is a spline between others; or cut. bottom, top: its faces at the ends.

    Raises:
        NoSurfaceError: OpenCASCADE cannot build them.
    """
    made = by_itself(field, solid, bottom, top)
    if made is None or _has_splines(made):
        with suppress(NoSurfaceError):
            return Rimmed(with_strips(field), False)
    return Rimmed(with_cut_rims(field, solid), False) if made is None else Rimmed(made, True)


def _has_splines(shape: TopoDS_Shape) -> bool:
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType as Kind

    splines = (Kind.GeomAbs_BSplineSurface, Kind.GeomAbs_BezierSurface, Kind.GeomAbs_OtherSurface)
    return any(BRepAdaptor_Surface(face).GetType() in splines for face in faces_of(shape))


def by_itself(
    field: Extrusion, solid: TopoDS_Shape, bottom: TopoDS_Shape, top: TopoDS_Shape
) -> TopoDS_Shape | None:
    """`with_rims` as OpenCASCADE's own fillets and chamfers have it; None where these fail."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    ends = [(rim, face) for rim, face in zip(field.rims, (bottom, top), strict=True) if rim.depth]
    for share in _SHARES:
        try:
            result = solid
            for rim, face in ends:
                result = _with_rim(result, face, rim, share)
        except opencascade_errors():
            continue
        if BRepCheck_Analyzer(result).IsValid():
            return result
    return None


def shallower(field: Swept) -> Iterator[tuple[Extrusion, float]]:
    """The field with rims that leave something of the wall, or of the end, and how far off it is; nothing
    where it has no rims."""
    if isinstance(field, Extrusion) and field.has_rims:
        depths = {name: getattr(field, name) for name in RIMS}
        less = {name: (1 - _SHALLOW) * depth for name, depth in depths.items()}
        yield dataclasses.replace(field, **less), _SHALLOW * max(depths.values())


def _with_rim(solid: TopoDS_Shape, face: TopoDS_Shape, rim: Rim, share: float) -> TopoDS_Shape:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer, BRepFilletAPI_MakeFillet

    making = BRepFilletAPI_MakeFillet(solid) if rim.fillet else BRepFilletAPI_MakeChamfer(solid)
    for edge in edges_of(face):
        making.Add(share * rim.depth, edge)
    making.Build()
    return making.Shape()
