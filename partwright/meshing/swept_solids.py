"""Extrusions and revolutions as closed meshes: corners on the surface, chords within a tolerance."""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, triangulate

from partwright.fields import Extrusion, Revolution
from partwright.fields.profile import Side, arc_chords
from partwright.meshing.manifolds import closed
from partwright.meshing.revolve import corners_of_circle

_SIDE = 1e3  # of a profile that is turned: manifold3d keeps eight digits behind the point


def extruded(field: Extrusion, tolerance: float) -> Manifold:
    """The extrusion in its own frame."""
    below, above, walls, count = [], [], [], 0
    for low, high, index in _strips(field, tolerance):
        below.append(low)
        above.append(high)
        walls.append((index, count))
        count += len(low)
    bottom, top = np.concatenate(below), np.concatenate(above)
    half, total = field.height / 2, len(bottom)
    vertices = np.concatenate(
        [np.column_stack([bottom, np.full(total, -half)]), np.column_stack([top, np.full(len(top), half)])]
    )
    faces, at = [], total
    for (index, start), high in zip(walls, above, strict=True):
        i = index + start
        j = np.arange(len(high)) + at
        a, b, c, d = i, np.roll(i, -1), np.roll(j, -1), j
        faces += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
        at += len(high)
    lid, offset = np.asarray(triangulate(above)) + total, 0
    base = np.asarray(triangulate(below))[:, ::-1]
    faces += [base + offset, lid]
    mesh = np.concatenate(faces)
    distinct = (mesh != np.roll(mesh, 1, axis=1)).all(axis=1)
    return closed(vertices, mesh[distinct])


def _strips(field: Extrusion, tolerance: float) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each loop the points (K, 2) at the bottom, (L, 2) at the top, and (L,) which one each stands on."""
    if not field.taper:
        lines = field.profile.polylines(tolerance)
        return [(line, line, np.arange(len(line))) for line in lines]
    result = []
    for loop in field.walls:
        below: list[np.ndarray] = []
        above: list[np.ndarray] = []
        index: list[int] = []
        for wall in loop:
            radius = max(wall.above.radius, wall.below.radius if wall.below else 0.0)
            count = arc_chords(radius, wall.above.sweep, tolerance) if wall.above.centre else 1
            above.append(_cut(wall.above, count))
            here = sum(map(len, below))
            if wall.below is None:
                index += [here] * count  # the next wall begins at this corner
            else:
                below.append(_cut(wall.below, count))
                index += range(here, here + count)
        low = np.concatenate(below)
        result.append((low, np.concatenate(above), np.array(index) % len(low)))
    return result


def _cut(side: Side, count: int) -> np.ndarray:
    """(count, 2) points from its start, in equal steps."""
    share = np.arange(count) / count
    if side.centre is None:
        return np.array(side.start) + share[:, None] * np.subtract(side.end, side.start)
    angle = share * side.sweep
    x, y = np.subtract(side.start, side.centre)
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([x * c - y * s, x * s + y * c]) + np.array(side.centre)


def revolved(field: Revolution, tolerance: float) -> Manifold:
    """The revolution in its own frame."""
    scale = _SIDE / field.profile.size
    lines = [line * scale for line in field.profile.polylines(tolerance)]
    radius = float(field.profile.bounds()[1][0])
    corners = corners_of_circle(radius, tolerance)
    section = CrossSection(lines, FillRule.Positive)
    solid = Manifold.revolve(section, corners, min(field.angle, 360.0))
    return solid.scale((1 / scale,) * 3)
