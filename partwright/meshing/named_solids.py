"""Named solids, extrusions, revolutions and pipes as closed meshes whose chords are within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from manifold3d import Manifold

from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Extrusion,
    Field,
    Frustum,
    HollowBox,
    HollowFrustum,
    Pipe,
    Revolution,
    Solid,
    Sphere,
    Swept,
    Torus,
    Tube,
)
from partwright.meshing.pipes import piped
from partwright.meshing.revolve import corners_of_circle, revolve
from partwright.meshing.swept_solids import extruded, revolved


def is_named(field: Field) -> bool:
    """Whether `named_solid` makes it."""
    return isinstance(field, Solid | Swept | Pipe)


def named_solid(solid: Field, tolerance: float) -> Manifold:
    """A `Solid`, extrusion, revolution or pipe in its own frame."""
    if isinstance(solid, Extrusion):
        return extruded(solid, tolerance)
    if isinstance(solid, Revolution):
        return revolved(solid, tolerance)
    if isinstance(solid, Pipe):
        return piped(solid, tolerance)
    assert isinstance(solid, Solid)
    angular = _ANGULAR.get(type(solid))
    if angular is not None:
        return angular(solid)
    profile = _PROFILES[type(solid)](solid, tolerance)
    return revolve(profile, corners_of_circle(float(profile[:, 0].max()), tolerance))


def _frustum(bottom: float, top: float, height: float) -> np.ndarray:
    corners = [(0.0, -height / 2), (bottom, -height / 2), (top, height / 2), (0.0, height / 2)]
    return np.array(corners if top > 0 else corners[:2] + corners[3:])


def _arc(radius: float, start: float, end: float, tolerance: float) -> np.ndarray:
    """(K, 2) from one angle to another, in quarter turns from the horizontal."""
    count = max(1, round(corners_of_circle(radius, tolerance) * abs(end - start) / 4))
    angle = np.linspace(start, end, count + 1) * (np.pi / 2)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _capsule(radius: float, height: float, tolerance: float) -> np.ndarray:
    """From pole to pole; a sphere where the height is 0."""
    rise = np.array([0.0, height / 2])
    lower = _arc(radius, -1.0, 0.0, tolerance) - rise
    upper = _arc(radius, 0.0, 1.0, tolerance) + rise
    profile = np.concatenate([lower, upper if height else upper[1:]])
    profile[[0, -1], 0] = 0.0
    return profile


def _tube(solid: Tube, _: float) -> np.ndarray:
    outer, inner, half = solid.radius, solid.radius - solid.thickness, solid.height / 2
    return np.array([(outer, -half), (outer, half), (inner, half), (inner, -half)])


def _hollow_frustum(solid: HollowFrustum, _: float) -> np.ndarray:
    share, half = 1 - solid.thickness / solid.bottom_radius, solid.height / 2
    outer = [(solid.bottom_radius, -half), (solid.top_radius, half)]
    inner = [(share * radius, z) for radius, z in reversed(outer)]
    return np.array([*outer, *(inner if solid.top_radius > 0 else inner[1:])])


_ANGULAR: dict[type[Solid], Callable[[Any], Manifold]] = {
    Box: lambda box: Manifold.cube(box.size, True),
    HollowBox: lambda box: Manifold.cube(box.size, True) - Manifold.cube(box.pieces()[1].size, True),
}

_PROFILES: dict[type[Solid], Callable[[Any, float], np.ndarray]] = {
    Cylinder: lambda s, _: _frustum(s.radius, s.radius, s.height),
    Cone: lambda s, _: _frustum(s.radius, 0.0, s.height),
    Frustum: lambda s, _: _frustum(s.bottom_radius, s.top_radius, s.height),
    Sphere: lambda s, tolerance: _capsule(s.radius, 0.0, tolerance),
    Capsule: lambda s, tolerance: _capsule(s.radius, s.height, tolerance),
    Torus: lambda s, tolerance: (
        _arc(s.minor_radius, 0.0, 4.0, tolerance)[:-1] + np.array([s.major_radius, 0.0])
    ),
    Tube: _tube,
    HollowFrustum: _hollow_frustum,
}
