"""Signed-distance fields: the SuperFrustum, the solids it contains, and operations on distances."""

from __future__ import annotations

from partwright.fields.base import Field
from partwright.fields.operations import (
    difference,
    intersection,
    smooth_difference,
    smooth_intersection,
    smooth_union,
    union,
)
from partwright.fields.quadric import Quadric
from partwright.fields.quadric_forms import NormalForm, normal_form
from partwright.fields.registry import KINDS, from_dict
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

__all__ = [
    "KINDS",
    "Box",
    "Capsule",
    "Cone",
    "Cylinder",
    "Field",
    "Frustum",
    "HollowBox",
    "HollowFrustum",
    "NormalForm",
    "Quadric",
    "Solid",
    "Sphere",
    "SuperFrustum",
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
