"""Building blocks of the shapes that the project makes itself: exact solids, and their closed meshes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.atomic_io import write_bytes

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

Point = tuple[float, float, float]
AROUND = 64  # corners of a full circle


def to_mesh(solid: Manifold) -> trimesh.Trimesh:
    """The solid's surface, closed."""
    import trimesh

    made = solid.to_mesh()
    vertices = np.asarray(made.vert_properties, dtype=np.float64)[:, :3]
    return trimesh.Trimesh(vertices, np.asarray(made.tri_verts), process=False)


def write_ply(mesh: trimesh.Trimesh, path: str | Path) -> None:
    """Write a mesh as binary PLY, the same bytes every time."""
    from trimesh.exchange.ply import export_ply

    write_bytes(path, export_ply(mesh))


def rod(height: float, bottom: float, top: float | None = None) -> Manifold:
    """Round about z from 0 up, of these radii."""
    from manifold3d import Manifold

    return Manifold.cylinder(height, bottom, bottom if top is None else top, AROUND)


def ring(radius: float, thickness: float, degrees: float = 360.0) -> Manifold:
    """A round rod of radius `thickness` bent around z."""
    from manifold3d import CrossSection, Manifold

    circle = CrossSection.circle(thickness, AROUND // 3).translate((radius, 0))
    return Manifold.revolve(circle, AROUND, degrees)


def ball(radius: float) -> Manifold:
    from manifold3d import Manifold

    return Manifold.sphere(radius, AROUND)


def bar(x: float, y: float, z: float) -> Manifold:
    """A box with its middle at the origin."""
    from manifold3d import Manifold

    return Manifold.cube((x, y, z), True)


def plate(x: float, y: float, height: float, corner: float) -> Manifold:
    """From z = 0 up, with rounded upright edges."""
    from manifold3d import CrossSection, JoinType, Manifold

    flat = CrossSection.square((x - 2 * corner, y - 2 * corner), True)
    return Manifold.extrude(flat.offset(corner, JoinType.Round, circular_segments=AROUND // 2), height)


def pebble(x: float, y: float, z: float, edge: float) -> Manifold:
    """A box with its middle at the origin and all edges rounded."""
    from manifold3d import Manifold

    corner = Manifold.sphere(edge, AROUND // 2)
    half = np.array((x, y, z)) / 2 - edge
    signs = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return Manifold.batch_hull([corner.translate(tuple(place)) for place in signs * half])


def limb(start: Point, end: Point, radius: float) -> Manifold:
    """A rod with round ends from one point to another."""
    from manifold3d import Manifold

    tip = Manifold.sphere(radius, AROUND // 2)
    return Manifold.batch_hull([tip.translate(start), tip.translate(end)])
