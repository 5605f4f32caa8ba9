"""SuperFrusta that are a canonical solid: docs/superfrustum.md lists the exact members."""

from __future__ import annotations

import math

from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    Solid,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)

SAME = 1e-5  # of the longest side: lengths that differ by less are the same


def exact_solid(field: Field) -> Solid | None:
    """The named solid that has the field's very surface, in the same place; None where there is none."""
    if isinstance(field, Solid):
        return field
    own = field.superfrustum()
    if own is None:
        return None
    lower, upper = own.bounds()
    same = SAME * float((upper - lower).max())
    if same == 0 or _bent(own, same):
        return None
    return _dilated(own, same) if own.dilation > same else _sharp(own, same)


def _bent(field: SuperFrustum, same: float) -> bool:
    """Whether the arc moves any of the surface: its middle, or the edges of its ends."""
    angle = field.bulge * math.pi / 2
    return field.size[2] / 2 * math.tan(angle / 2) > same or field.size[0] / 2 * math.sin(angle) > same


def _dilated(field: SuperFrustum, same: float) -> Solid | None:
    """Offsets of a point, a segment and a circle."""
    x, y, z = field.size
    if max(x, y) <= same:
        return Sphere(field.dilation) if z <= same else Capsule(field.dilation, z)
    major, flat = min(x, y) / 2, z <= same and abs(1 - field.taper) * x <= same
    if _round(field, same) and flat and (1 - field.onion) * major <= same and field.dilation < major:
        return Torus(major, field.dilation)
    return None


def _sharp(field: SuperFrustum, same: float) -> Solid | None:
    """What has edges: no dilation."""
    x, y, z = field.size
    middle = min(x, y) / 2
    if min(x, y, z) <= same:
        return None
    straight, hollow = abs(1 - field.taper) * middle <= same, field.onion * middle > same
    if field.roundness * middle <= same:
        return Box(field.size) if straight and not hollow else None
    if not _round(field, same):
        return None
    if hollow:
        wall = (1 - field.onion) * middle
        return Tube(middle, wall, z) if straight and wall > same else None
    if straight:
        return Cylinder(middle, z)
    top = field.taper * middle
    return Frustum(middle, top, z) if top > same else Cone(middle, z)


def _round(field: SuperFrustum, same: float) -> bool:
    x, y, _ = field.size
    return abs(x - y) <= same and (1 - field.roundness) * min(x, y) / 2 <= same
