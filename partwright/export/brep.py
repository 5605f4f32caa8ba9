"""Exact B-rep solids by OpenCASCADE, of the `cad` extra: analytic faces, no facets.

Three constructions cover the SuperFrustum: round ones are their profile turned about the axis, other straight
ones their profile swept around the rounded rectangle, bent ones that along the arc. Extrusions and
revolutions are what OpenCASCADE makes of their profiles; pipes are sewn of the walls along their paths. What
was built is checked against the field: where OpenCASCADE lost something, the part does not count as built.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.nearest import Approximation
from partwright.approximation.recognise import SAME
from partwright.assembly import Part
from partwright.assembly.rows import as_superfrustum
from partwright.errors import NoSurfaceError
from partwright.export.brep_bent import bent_solid
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_mended_profile import mended
from partwright.export.brep_pipe import pipe_solid
from partwright.export.brep_profile import Outline, clipped, inner_outline, outer_outline
from partwright.export.brep_rims import shallower
from partwright.export.brep_solids import revolved
from partwright.export.brep_swept import Sweep
from partwright.export.brep_swept_profile import swept_profile
from partwright.export.brep_topology import faces_of, volume_and_area, volume_of
from partwright.fields import Field, Pipe, SuperFrustum, Swept
from partwright.meshing import mesh_part

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_SHORTEST = 1e-5  # of the longest side: shorter edges are left out
_STRAIGHT = 1e-4  # radians: an arc of this half angle is none
# What is built may be off by this share of volume and longest side; the mesh that it is held against lacks a
# few percent of thin walls, and where OpenCASCADE fails it loses a whole wall, hole or end.
_SAME_VOLUME, _SAME_PLACE = 0.05, 2e-3


def built(part: Part) -> Approximation | None:
    """The part as `solid_of` builds it, or unbent where its bend cannot be built and hardly shows; None where
    neither is the part's surface. `max_deviation` is 0 where all faces are the very surface."""
    field = part.field
    if field.quadric() is not None:  # by `quadric_solid`, or not at all
        return Approximation(field, part, 0.0, 0.0)
    if isinstance(field, Swept):
        return _built_swept(part, field)
    if isinstance(field, Pipe):
        return Approximation(field, part, 0.0, 0.0)
    f = field.superfrustum()
    if f is None or f.thinnest < SAME * max(*f.size, f.dilation):
        return None
    for candidate in dict.fromkeys((f, dataclasses.replace(f, bulge=0.0))):
        off = _off(candidate, f)
        if off is not None:
            kept = part if candidate is f else dataclasses.replace(part, field=candidate)
            return Approximation(kept.field, kept, *off)
    return None


def _built_swept(part: Part, field: Swept) -> Approximation:
    """Exact, or with the nearest rims or profile that OpenCASCADE takes; where there are none it is left to
    facets."""
    exact = Approximation(field, part, 0.0, 0.0)
    with suppress(NoSurfaceError):
        solid_of(field)
        return exact
    for near, off in (*shallower(field), *mended(field)):
        with suppress(NoSurfaceError):
            volume, area = volume_and_area(solid_of(near))
            return Approximation(near, dataclasses.replace(part, field=near), area * off / volume, off)
    return exact


@lru_cache(maxsize=256)
def solid_of(field: Field) -> TopoDS_Shape:
    """The field as a solid in its own frame.

    Raises:
        NoSurfaceError: OpenCASCADE cannot build it.
    """
    if isinstance(field, Swept):
        return _swept(field)
    if isinstance(field, Pipe):
        return pipe_solid(field)
    f = as_superfrustum(field)
    longest = max(*f.size, f.dilation)
    corner = f.roundness * min(f.size[:2]) / 2
    d = f.dilation if f.dilation > _SHORTEST * longest else 0.0
    half_x, half_y = (_not_tiny(side / 2 - corner, longest) for side in f.size[:2])
    sweep = Sweep(half_x, half_y, _SHORTEST * longest)
    body = _body(f, sweep)
    failures: tuple[type[Exception], ...] = (*opencascade_errors(), IndexError)  # an outline of no length
    try:
        if f.bulge * math.pi / 2 < _STRAIGHT and _turns(f):
            return revolved(f)
        outer = clipped(outer_outline(f, corner, d), -math.inf, sweep.shortest)
        result = body(outer[0])
        if f.hollow:
            inner = clipped(inner_outline(f, corner, d), -min(half_x, half_y), sweep.shortest)
            result = _without(result, [body(run) for run in inner])
    except failures as error:
        raise NoSurfaceError("a part is too thin for a B-rep") from error
    return result


def _swept(field: Swept) -> TopoDS_Shape:
    from OCP.BRepCheck import BRepCheck_Analyzer

    shape = swept_profile(field)
    volume = float(mesh_part(Part(field), 128).volume)
    if abs(volume_of(shape) / volume - 1) > _SAME_VOLUME or not BRepCheck_Analyzer(shape).IsValid():
        raise NoSurfaceError(f"OpenCASCADE fails at an {field.kind}; keep its outline from touching itself")
    return shape


def _not_tiny(half: float, longest: float) -> float:
    return half if half > 10 * _SHORTEST * longest else 0.0


def _body(f: SuperFrustum, sweep: Sweep) -> Callable[[Outline], TopoDS_Shape]:
    angle = f.bulge * math.pi / 2
    if angle < _STRAIGHT:
        return sweep.solid
    return lambda outline: bent_solid(sweep, outline, f.size[2] / 2, angle)


def _without(solid: TopoDS_Shape, holes: list[TopoDS_Shape]) -> TopoDS_Shape:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    for hole in holes:
        cut = BRepAlgoAPI_Cut(solid, hole)
        if not cut.IsDone():
            raise NoSurfaceError("the hole of a part cannot be cut; it is too thin for a B-rep")
        solid = cut.Shape()
    return solid


@lru_cache(maxsize=256)
def _off(built_field: SuperFrustum, field: SuperFrustum) -> tuple[float, float] | None:
    """How far what is built of one field is off another: share of the volume at most, and length at most."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    longest = max(*field.size, field.dilation)
    try:
        shape = solid_of(built_field)
        volume = float(mesh_part(Part(field), 64).volume)
    except NoSurfaceError:
        return None
    bulk, area = volume_and_area(shape)
    places = _places(shape, 2e-3 * longest)
    deviation = float(np.abs(field(places)).max())
    valid = BRepCheck_Analyzer(shape).IsValid()
    if not valid or abs(bulk / volume - 1) > _SAME_VOLUME or deviation > _SAME_PLACE * longest:
        return None
    exact = built_field == field and _analytic(field)
    return (0.0, 0.0) if exact else (area * deviation / bulk, deviation)


def _analytic(f: SuperFrustum) -> bool:
    """Whether all faces are: a bend with taper is a surface through sections."""
    return f.bulge * math.pi / 2 < _STRAIGHT or abs(f.taper - 1) < SAME


def _places(shape: TopoDS_Shape, chord: float) -> np.ndarray:
    """Places (N, 3) float32 on the shape's surface."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(shape, chord, False, 0.3, False)
    places = []
    for face in faces_of(shape):
        location = TopLoc_Location()
        triangles = BRep_Tool.Triangulation_s(face, location)
        if triangles is not None:
            pose = location.Transformation()
            nodes = (triangles.Node(i + 1).Transformed(pose) for i in range(triangles.NbNodes()))
            places += [(node.X(), node.Y(), node.Z()) for node in nodes]
    return np.array(places, np.float32).reshape(-1, 3)


def _turns(f: SuperFrustum) -> bool:
    """Round, not flat, and its hole is either open along its whole length or closed."""
    width, middle = max(f.size[:2]), min(f.size[:2]) / 2
    is_round = abs(f.size[0] - f.size[1]) <= SAME * width and (1 - f.roundness) * middle <= SAME * width
    upright = f.size[2] > SAME * width or abs(f.taper - 1) <= SAME
    closed = not f.hollow
    open_throughout = min(1.0, f.taper) * middle * f.onion > f.dilation + SAME * width
    solid = f.dilation > 0 or (min(width, f.size[2]) > 0 and f.onion < 1)
    return is_round and upright and solid and (closed or open_throughout)
