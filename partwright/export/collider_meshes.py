"""Colliders as closed convex meshes, for engines that know them by their names alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import Geometry
from partwright.approximation.light_hull import light_hull
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of

if TYPE_CHECKING:
    import trimesh

MOST_CORNERS = 250  # of a hull: engines that count them in a byte take no more
_SIDES = 24  # of what is round
_LOST = 1e-4  # of its size: what a hull may lose for fewer corners


def collider_mesh(geometry: Geometry) -> trimesh.Trimesh:
    """The convex mesh of a native solid, or of a hull with `MOST_CORNERS` at most, in its place.

    Raises:
        NoSurfaceError: it is flat.
    """
    if geometry.part is None:
        assert geometry.mesh is not None
        return _hull(np.asarray(geometry.mesh.vertices))
    mesh = _solid(geometry.part.field)
    pose = geometry.part.pose
    mesh.vertices = pose(np.asarray(mesh.vertices))
    return mesh


def _solid(field: Field) -> trimesh.Trimesh:
    import trimesh

    match field:
        case Box(size=size):
            return trimesh.creation.box(size)
        case Sphere(radius=radius):
            return trimesh.creation.icosphere(subdivisions=2, radius=radius)
        case Capsule(radius=radius, height=height):
            made = trimesh.creation.capsule(height, radius, count=[_SIDES // 3, 2 * _SIDES // 3])
            return made.apply_translation((0, 0, -made.bounds.mean(axis=0)[2]))
        case Cylinder(radius=radius, height=height):
            return trimesh.creation.cylinder(radius, height, sections=_SIDES)
    raise AssertionError(f"{field.kind} has no collider mesh")


def _hull(places: np.ndarray) -> trimesh.Trimesh:
    """At a size of 1: hulls of meshes in micrometres would lose their triangles in metres."""
    import trimesh

    lower, upper = places.min(axis=0), places.max(axis=0)
    middle, side = (lower + upper) / 2, float((upper - lower).max())
    if not side > 0:
        raise NoSurfaceError("a collider has no size")
    whole = hull_of((places - middle) / side)
    corners, faces = surface_of(light_hull(whole, _LOST, MOST_CORNERS)[0])
    if whole.volume() <= 0:
        raise NoSurfaceError("a collider is flat")
    return trimesh.Trimesh(corners * side + middle, faces, process=False)
