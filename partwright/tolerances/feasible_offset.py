"""What the augmented Lagrangian leaves over is removed exactly: parts grow or shrink by what is missing.

Every fold of a tree passes a shift on: where all leaves grow by e (those that are subtracted shrink), F falls
by e. So growing the leaf that decides F at a point lowers F there, and no other point rises.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.rows import as_superfrustum
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Field, Pipe, Revolution, SuperFrustum, Swept
from partwright.fields.extrusion import RIMS
from partwright.fields.profile_growth import grown_profile
from partwright.fields.solids import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Frustum,
    HollowBox,
    HollowFrustum,
    Sphere,
    Torus,
    Tube,
)
from partwright.fields.superfrustum import tightest_bulge
from partwright.tolerances.augmented_lagrangian import Constraints
from partwright.tolerances.leaves import weigh

_PASSES = 20
_LEAST_WEIGHT = 0.25
_THINNEST = 1e-3  # unit lengths: a thinner part is as good as none
_ROOM = 2e-6  # unit lengths, for rounding to float32


def offset_to_feasible(
    assembly: Assembly, wanted: Constraints, locked: frozenset[str] = frozenset()
) -> Assembly:
    """The assembly with the constraints met by changes of size, as far as that goes; leaves in `locked` stay,
    and those that would shrink to nothing go.

    Points that ask for more come first; where some ask a leaf to grow and others to shrink it stays between.
    """
    for _ in range(_PASSES):
        value, weights = weigh(assembly, wanted.points)
        violation = wanted.violation(value)
        broken = np.flatnonzero(np.abs(violation) > 0)
        if len(broken) == 0:
            break
        leaf = np.abs(weights[:, broken]).argmax(axis=0)
        weight = weights[leaf, broken]
        growth = violation[broken] / np.sign(weight) / np.maximum(np.abs(weight), _LEAST_WEIGHT)
        new = assembly
        for i, part in enumerate(assembly.parts):
            mine = growth[leaf == i]
            if part.name in locked or len(mine) == 0:
                continue
            most, least = max(mine.max(), 0.0), min(mine.min(), 0.0)
            step = most + least + math.copysign(_ROOM, most + least)
            new = _resized(new, part, step)
        if new is assembly:
            break
        assembly = new
    return assembly


def _resized(assembly: Assembly, part: Part, by: float) -> Assembly:
    """The assembly with one part grown; without it where nothing of it would be left."""
    try:
        new = grown(part, by)
    except ParameterError:
        new = None
    if new is not None and _thinnest(new.field) > _THINNEST:
        return assembly.replace_part(part.name, new)
    try:
        return assembly.without(part.name)
    except ParameterError:  # it is all there is
        return assembly


def _thinnest(field: Field) -> float:
    """Profiles and pipes that grow check themselves."""
    return field.wall if isinstance(field, Swept | Pipe) else as_superfrustum(field).thinnest


def grown(part: Part, by: float) -> Part:
    """A part whose surface lies `by` further out everywhere (further in where negative), or a little more
    where its kind cannot do so exactly: a box stays a box, so its corners move further.

    Raises:
        ParameterError: nothing of the part would be left.
    """
    field, along = _grown(part.field, by)
    shift = Similarity(1.0, part.rotation)(np.array([[0.0, 0.0, along]]))[0]
    return replace(part, field=field, translation=tuple((np.array(part.translation) + shift).tolist()))


def _dilated(field: SuperFrustum, by: float) -> SuperFrustum:
    """Its dilation takes all; where none is left the sides give way, and a hole gets wider."""
    dilation = field.dilation + by
    if dilation >= 0:
        return replace(field, dilation=dilation)
    x, y, z = (v + 2 * dilation for v in field.size)
    hole = min(field.size[:2]) / 2 * field.onion - dilation if field.onion > 0 else 0.0
    onion = hole / max(min(x, y) / 2, 1e-12) if hole else 0.0
    bulge = min(field.bulge, tightest_bulge(x, z))
    return replace(field, dilation=0.0, size=(x, y, z), bulge=bulge, onion=onion)


def _grown_extrusion(field: Extrusion, by: float) -> Extrusion:
    """Walls that lean stay as steep, rims as they are in a parallel surface."""
    lean = math.radians(field.taper)
    out = by * (1 / math.cos(lean) + math.tan(lean))  # at the lower end, which is further down
    rims = {name: value for name in RIMS if (value := getattr(field, name))}
    rims = {
        name: max(0.0, value + by * (1.0 if "fillet" in name else 2 - math.sqrt(2)))
        for name, value in rims.items()
    }
    return replace(field, profile=grown_profile(field.profile, out), height=field.height + 2 * by, **rims)


def _grown_pipe(field: Pipe, by: float) -> Pipe:
    """Its ends go out along the path; where its wall meets in the middle it is solid."""
    path = field.corners
    for end, (_, out) in zip((0, -1), field.ends, strict=True):
        path[end, :3] += by * out
    wall = field.thickness + 2 * by if field.thickness else 0.0
    radius = field.radius + by
    return replace(field.with_corners(path), radius=radius, thickness=wall if wall < radius else 0.0)


def _grown(field: Field, by: float) -> tuple[Field, float]:
    """The field, and how far its centre moves along its axis."""
    match field:
        case SuperFrustum():
            return _dilated(field, by), 0.0
        case Box():
            x, y, z = field.size
            return Box((x + 2 * by, y + 2 * by, z + 2 * by)), 0.0
        case Cylinder():
            return Cylinder(field.radius + by, field.height + 2 * by), 0.0
        case HollowBox():
            x, y, z = field.size
            return HollowBox((x + 2 * by, y + 2 * by, z + 2 * by), field.thickness + 2 * by), 0.0
        case Sphere():
            return Sphere(field.radius + by), 0.0
        case Capsule():
            return Capsule(field.radius + by, field.height), 0.0
        case Tube():
            return Tube(field.radius + by, field.thickness + 2 * by, field.height + 2 * by), 0.0
        case Torus():
            return Torus(field.major_radius, field.minor_radius + by), 0.0
        case Cone():
            slant = math.hypot(field.radius, field.height)
            # the offset cone has the same angle; its tip moves by slant / radius, its base by one
            height = field.height + by * (1 + slant / field.radius)
            return Cone(field.radius / field.height * height, height), (height - field.height) / 2 - by
        case Frustum() | HollowFrustum():
            lean = (field.bottom_radius - field.top_radius) / field.height
            out, along = by * math.hypot(1.0, lean), by * lean
            bottom, top = field.bottom_radius + out + along, max(field.top_radius + out - along, 0.0)
            if isinstance(field, Frustum):
                return Frustum(bottom, top, field.height + 2 * by), 0.0
            # the hole narrows where its wall is thinnest in proportion, and a little more elsewhere
            wall = field.thickness + 2 * out + 2 * abs(along)
            return HollowFrustum(bottom, top, wall, field.height + 2 * by), 0.0
        case Extrusion():
            return _grown_extrusion(field, by), 0.0
        case Pipe():
            return _grown_pipe(field, by), 0.0
        case Revolution():  # whose flat ends, where it is no whole turn, stay
            return replace(field, profile=field.grown_profile(by)), 0.0
    raise ParameterError(f"a field of kind {field.kind!r} has no offset of its own kind")
