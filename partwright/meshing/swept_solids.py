"""Extrusions and revolutions as closed meshes: corners on the surface, chords within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, triangulate

from partwright.fields import Extrusion, Revolution
from partwright.fields.profile import Side, arc_chords
from partwright.fields.profile_offset import Wall, turns_at_arcs
from partwright.fields.rims import Rim
from partwright.meshing.manifolds import closed
from partwright.meshing.revolve import corners_of_circle

_FLAT = 1e-9  # of half the height: between rims that meet there is no wall
_CURVED = 12  # steps of a chamfer whose mitres are curves
_SIDE = 1e3  # of a profile that is turned: manifold3d keeps eight digits behind the point


def extruded(field: Extrusion, tolerance: float) -> Manifold:
    """The extrusion in its own frame."""
    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    lids: tuple[list[int], list[int]] = ([], [])  # vertices around the bottom and the top
    rings: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    count = 0
    for levels in _loops(field, tolerance):
        rows, starts = [], []
        for points, height, index in levels:
            vertices.append(np.column_stack([points, np.full(len(points), height)]))
            rows.append(index + count)
            starts.append(count)
            count += len(points)
        for end in (0, -1):
            points = levels[end][0]
            rings[end].append(points)
            lids[end].extend(range(starts[end], starts[end] + len(points)))
        for low, high in pairwise(rows):
            after, above = np.roll(low, -1), np.roll(high, -1)
            faces += [np.stack([low, after, above], 1), np.stack([low, above, high], 1)]
    corners = np.concatenate(vertices)
    for end in (0, -1):
        lid = np.array(lids[end])[np.asarray(triangulate(rings[end]))]
        faces.append(lid if end else lid[:, ::-1])
    mesh = np.concatenate(faces)
    distinct = (mesh != np.roll(mesh, 1, axis=1)).all(axis=1)
    return closed(corners, mesh[distinct])


Level = tuple[np.ndarray, float, np.ndarray]


def _loops(field: Extrusion, tolerance: float) -> Iterator[list[Level]]:
    """Of each loop its levels from the bottom to the top: points (K, 2), their height, and (L,) which of them
    each of the L strips that go up begins at; the same strips at every level."""
    half = field.height / 2
    if field.taper:
        for below, above, index in _strips(field.walls, _chords(field.walls, tolerance)):
            yield [(below, -half, index), (above, half, np.arange(len(above)))]
        return
    if not field.has_rims:
        for line in field.profile.polylines(tolerance):
            yield [(line, -half, own := np.arange(len(line))), (line, half, own)]
        return
    straight = not turns_at_arcs(field.profile) and not field.collapses
    down, up = (_steps(rim, tolerance, straight, field.collapses) for rim in field.rims)
    walls_at = {depth: field.within(depth)[1] for depth, _ in (*down, *up) if depth > 0}
    cut = [_chords(walls, tolerance) for walls in walls_at.values()]
    chords = [np.max(counts, axis=0).tolist() for counts in zip(*cut, strict=True)]
    inner = {depth: list(_strips(walls, chords)) for depth, walls in walls_at.items()}
    for k, (below, above, index) in enumerate(inner[max(inner)]):
        own = np.arange(len(above))
        levels: list[Level] = []
        walls = [(-half + down[0][1], below), (half - up[0][1], below)]
        for depth, off in reversed(down[1:]):
            levels.append((inner[depth][k][1], -half + off, own))
        levels += [
            (points, height, index)
            for height, points in walls[: 1 + (walls[1][0] - walls[0][0] > _FLAT * half)]
        ]
        for depth, off in up[1:]:
            levels.append((inner[depth][k][1], half - off, own))
        yield levels


def _steps(
    rim: Rim, tolerance: float, straight: bool, collapses: Sequence[float]
) -> list[tuple[float, float]]:
    """straight: whether all edges across the rim are lines where the rim is a chamfer. collapses: depths
    around which sides vanish."""
    chamfer = 1 if straight else _CURVED
    steps = rim.steps(arc_chords(rim.fillet, math.pi / 2, tolerance) if rim.fillet else chamfer)
    return sorted({*steps, *(rim.step_at(depth) for depth in collapses if depth < rim.depth)})


def _strips(
    walls: list[list[Wall]], chords: list[list[int]]
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each loop the points (K, 2) on the profile, (L, 2) deeper within, and (L,) what each grew out of.
    chords: of each wall."""
    for loop, counts in zip(walls, chords, strict=True):
        below: list[np.ndarray] = []
        above: list[np.ndarray] = []
        index: list[int] = []
        for wall, count in zip(loop, counts, strict=True):
            above.append(_cut(wall.above, count))
            here = sum(map(len, below))
            if wall.below is None:
                index += [here] * count  # the next wall begins at this corner
            else:
                below.append(_cut(wall.below, count))
                index += range(here, here + count)
        low = np.concatenate(below)
        yield low, np.concatenate(above), np.array(index) % len(low)


def _chords(walls: list[list[Wall]], tolerance: float) -> list[list[int]]:
    """How many each wall is cut into."""
    return [[_chords_of(wall, tolerance) for wall in loop] for loop in walls]


def _chords_of(wall: Wall, tolerance: float) -> int:
    if wall.above.centre is None:
        return 1
    radius = max(wall.above.radius, wall.below.radius if wall.below else 0.0)
    sweep = wall.below.sweep if wall.below else wall.above.sweep
    return arc_chords(radius, sweep, tolerance)


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
