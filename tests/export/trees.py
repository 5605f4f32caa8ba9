"""Assemblies whose volume is known, for the CAD formats."""

from __future__ import annotations

import math

from partwright.assembly import Assembly, Part
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)

TURNED = (0.8, 0.2, 0.4, 0.4)
PI = math.pi
SOLIDS: dict[Field, float] = {
    Box((1, 2, 3)): 6.0,
    Cylinder(0.5, 1): PI / 4,
    Cone(0.5, 1): PI / 12,
    Frustum(0.5, 0.9, 1): PI * (0.25 + 0.45 + 0.81) / 3,
    Frustum(0.5, 0.5, 1): PI / 4,
    Frustum(0.5, 0.0, 1): PI / 12,
    Sphere(0.5): PI / 6,
    Capsule(0.3, 1): PI * (0.09 + 4 / 3 * 0.027),
    Tube(0.5, 0.1, 1): PI * (0.25 - 0.16),
    Torus(0.5, 0.1): 2 * PI**2 * 0.5 * 0.01,
}
# The sources draw these themselves: rounded, sharp above its middle, hollow, bent, bent and hollow, a ring.
SUPERFRUSTA = (
    SuperFrustum((1, 1, 2), 1.0, 0.05, 0.6),
    SuperFrustum((1, 0.7, 2), 0.3, 0.0, 0.0),
    SuperFrustum((1, 0.7, 1), 0.3, 0.02, 1.4, 0.0, 0.6),
    SuperFrustum((0.3, 0.4, 2), 0.2, 0.05, 1.0, 0.8),
    SuperFrustum((0.3, 0.4, 2), 0.2, 0.02, 0.6, 0.5, 0.5),
    SuperFrustum((0.5, 0.5, 0), 1.0, 0.1, 1.0, 0.0, 0.6),
)
# Their holes close at one end, or they bend about a centre within themselves.
UNDRAWN = (
    SuperFrustum((0.3, 0.4, 2), 0.2, 0.05, 0.4, 0.0, 0.5),
    SuperFrustum((1, 1, 0.5), 0.2, 0.05, 1.0, 1.0),
)


def lone(field: Field, **about: str) -> Assembly:
    return Assembly((Part(field, (1, 2, 3), TURNED, name="a part"),), **about)


def flange(unit: str | None = "mm") -> tuple[Assembly, float]:
    """A plate with a boss, less a hole and what a slab and a cylinder share; names are hostile."""
    plate, boss = Part(Box((4, 4, 1)), name="for"), Part(Cylinder(0.5, 2), (0, 0, 1.4), name="boss\\")
    hole = Part(Cylinder(0.3, 6), (1.2, 1.2, 0), name="lambda")
    pocket = Assembly(
        (Part(Cylinder(0.4, 3), (-1.2, 0, 0), name="3d"), Part(Box((9, 9, 0.5)), name="#")), "intersection"
    )
    body = Assembly((plate, boss), name="body")
    whole = Assembly((body, hole, pocket), "difference", name="Flansch ä", unit=unit)
    return whole, 16 + PI * 0.25 * 1.9 - PI * 0.09 - PI * 0.16 * 0.5
