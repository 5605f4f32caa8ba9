"""A bent or hollow part as convex pieces: straight segments along the arc, wedges around the hole."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Part, Similarity
from partwright.assembly.rows import as_superfrustum
from partwright.fields import SuperFrustum
from partwright.meshing import mesh_part

if TYPE_CHECKING:
    import trimesh

MOST_SEGMENTS, FEWEST_WEDGES, MOST_WEDGES = 12, 6, 16
_STRAIGHT = 1e-3  # radians


def segments(part: Part, allowed: float) -> list[Part]:
    """The part as straight ones along its arc, whose chords leave the arc by no more than `allowed`,
    nor by half the part's thickness.

    Each has the cross-section, taper, hole and dilation that the part has there. A straight part is one.
    """
    f = as_superfrustum(part.field)
    angle, h = f.bulge * math.pi / 2, f.size[2] / 2
    if angle < _STRAIGHT or h == 0:
        return [part]
    radius = h / math.sin(angle)
    outermost = radius + max(1.0, f.taper) * f.size[0] / 2 + f.dilation
    step = math.acos(max(1 - min(allowed, f.thinnest / 2) / outermost, 0.0))
    count = min(max(math.ceil(angle / step), 2), MOST_SEGMENTS)
    pose = Similarity(1.0, part.rotation, part.translation)
    result = []
    for i in range(count):
        turn = angle * ((2 * i + 1) / count - 1)
        place = (radius * (math.cos(angle) - math.cos(turn)), 0.0, radius * math.sin(turn))
        local = pose @ Similarity(1.0, (math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0), place)
        field = _segment(f, i / count, (i + 1) / count, 2 * radius * math.tan(angle / count))
        name = f"{part.name}/{i + 1}"
        result.append(Part(field, local.translation, local.rotation, part.blend, name))
    return result


def wedges(part: Part, allowed: float, resolution: int) -> list[trimesh.Trimesh]:
    """Convex meshes that make up a straight part with a hole: hulls of its wedges around the axis.

    So many that no chord leaves a round wall by more than `allowed` or half its thickness. A part without a
    hole is one.
    """
    import trimesh
    from manifold3d import Manifold, Mesh

    f = as_superfrustum(part.field)
    mesh = mesh_part(Part(dataclasses.replace(f, bulge=0.0)), resolution)
    side = float(np.ptp(mesh.vertices, axis=0).max())
    solid = Manifold(Mesh((mesh.vertices / side).astype(np.float32), mesh.faces.astype(np.uint32)))
    parts = [solid]
    if f.hollow:
        reach = max(1.0, f.taper) * max(f.size[:2]) / 2
        turn = math.acos(max(1 - min(allowed, f.thinnest / 2) / reach, 0.0))
        count = min(max(math.ceil(math.pi / turn), FEWEST_WEDGES), MOST_WEDGES)
        parts = [_wedge(solid, f, i, count) for i in range(count)]
    pose = Similarity(1.0, part.rotation, part.translation)
    result = []
    for one in parts:
        hull = one.hull()
        if hull.volume() > 0:
            found = hull.to_mesh()
            result.append(
                trimesh.Trimesh(pose(found.vert_properties[:, :3] * side), found.tri_verts, process=False)
            )
    return result


def _segment(f: SuperFrustum, start: float, stop: float, height: float) -> SuperFrustum:
    """The stretch of the part between two shares of its height, on a height of its own."""
    m = min(f.size[:2]) / 2
    first, last = (m * (f.taper - 1) * share for share in (start, stop))
    corner = max(f.roundness * m + first, 0.0)
    middle = m + first
    if middle <= 0:  # beyond a tip
        return dataclasses.replace(f, size=(0.0, 0.0, height), bulge=0.0)
    return SuperFrustum(
        (f.size[0] + 2 * first, f.size[1] + 2 * first, height),
        min(corner / middle, 1.0),
        f.dilation,
        min(max((m + last) / middle, 0.0), 2.0),
        0.0,
        f.onion,
    )


def _wedge(solid, f: SuperFrustum, index: int, count: int):  # type: ignore[no-untyped-def]  # Manifolds
    """What lies between two half planes through the axis, which stand evenly around the cross-section."""
    for i, sign in ((index, 1.0), (index + 1, -1.0)):
        turn = 2 * math.pi * (i + 0.5) / count
        x, y = f.size[0] * math.cos(turn), f.size[1] * math.sin(turn)
        normal = np.array([-y, x, 0.0]) * sign
        solid = solid.trim_by_plane(tuple(normal / np.linalg.norm(normal)), 0.0)
    return solid
