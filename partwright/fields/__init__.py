"""Signed-distance fields: the SuperFrustum, the solids it contains, profiles extruded and turned, and
operations on distances."""

from __future__ import annotations

from partwright.fields.base import Field
from partwright.fields.extrusion import Extrusion
from partwright.fields.operations import (
    difference,
    intersection,
    smooth_difference,
    smooth_intersection,
    smooth_union,
    union,
)
from partwright.fields.pipe import Pipe
from partwright.fields.profile import Profile
from partwright.fields.quadric import Quadric
from partwright.fields.quadric_forms import NormalForm, normal_form
from partwright.fields.registry import KINDS, from_dict
from partwright.fields.revolution import Revolution
from partwright.fields.solids import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Frustum,
    HollowBox,
    HollowFrustum,
    Solid,
    Sphere,
    Torus,
    Tube,
)
from partwright.fields.superfrustum import SuperFrustum
from partwright.fields.swept import Swept

__all__ = [
    "KINDS",
    "Box",
    "Capsule",
    "Cone",
    "Cylinder",
    "Extrusion",
    "Field",
    "Frustum",
    "HollowBox",
    "HollowFrustum",
    "NormalForm",
    "Pipe",
    "Profile",
    "Quadric",
    "Revolution",
    "Solid",
    "Sphere",
    "SuperFrustum",
    "Swept",
    "Torus",
    "Tube",
    "difference",
    "from_dict",
    "intersection",
    "normal_form",
    "smooth_difference",
    "smooth_intersection",
    "smooth_union",
    "union",
]
