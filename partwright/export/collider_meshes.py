"""Colliders as closed convex meshes, for engines that know them by their names alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import Geometry
from partwright.approximation.light_hull import light_hull
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.hulls import file_hull, hull_of
from partwright.meshing.manifolds import as_mesh, surface_of

if TYPE_CHECKING:
    import trimesh

MOST_CORNERS = 250  # of a hull: engines that count them in a byte take no more
_SIDES = 24  # of what is round
_LOST = 1e-4  # of its size: what a hull may lose for fewer corners


def collider_mesh(geometry: Geometry, frame: np.ndarray | None = None) -> trimesh.Trimesh:
    """The convex mesh of a native solid, or of a hull with `MOST_CORNERS` at most, in its place.

    frame: (4, 4), to where the file has it.

    Raises:
        NoSurfaceError: it is flat.
    """
    if geometry.part is None:
        assert geometry.mesh is not None
        corners = _corners(np.asarray(geometry.mesh.vertices))
    else:
        corners = geometry.part.pose(np.asarray(_solid(geometry.part.field).vertices))
    if frame is not None:
        corners = corners @ frame[:3, :3].T + frame[:3, 3]
    return as_mesh(file_hull(corners))


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


def _corners(places: np.ndarray) -> np.ndarray:
    """(V, 3) of the hull. At a size of 1: hulls of meshes in micrometres would lose their triangles in
    metres."""
    lower, upper = places.min(axis=0), places.max(axis=0)
    middle, side = (lower + upper) / 2, float((upper - lower).max())
    if not side > 0:
        raise NoSurfaceError("a collider has no size")
    whole = hull_of((places - middle) / side)
    if whole.volume() <= 0:
        raise NoSurfaceError("a collider is flat")
    corners, _ = surface_of(light_hull(whole, _LOST, MOST_CORNERS)[0])
    return corners * side + middle
