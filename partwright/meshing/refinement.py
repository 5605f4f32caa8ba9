"""Triangles that cut across a bend of the surface, halved until they follow it.

A fillet narrower than a cell crosses each cell elsewhere: in one a chord is left of it, in the next a corner,
and what should be a straight edge looks like a string of beads. Edges of triangles there are halved, and
their middles moved onto the zero level.
"""

from __future__ import annotations

import numpy as np

from partwright.meshing.blocks import Distance, Grid, evaluate
from partwright.meshing.features import NORMAL_STEP, field_normals
from partwright.rows import lengths

_BENT = 0.97  # cosine between the normals at an edge's ends (14 degrees) under which it may cut across a bend
_OPPOSED = -0.3  # that cosine where the ends are rather on two sides of a sheet
_OFF = 0.03  # of a cell, how far the middle of an edge may be from the surface
_PASSES = 3
_STEPS = 2  # of the secant method
_FURTHEST = 0.5  # of an edge's length, how far its middle may be moved
_FLATTEST = 0.2  # slope along a normal under which the secant would shoot beyond
# By how many edges are cut: the corners of each piece among a, b, c and the middles of ab, bc and ca.
_OTHER_WAY = 4  # two, and the other diagonal
_PIECES = {
    1: ((0, 3, 2), (3, 1, 2)),
    2: ((0, 1, 4), (0, 4, 5), (5, 4, 2)),
    _OTHER_WAY: ((0, 1, 5), (1, 4, 5), (5, 4, 2)),
    3: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
}


def refined(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, distance: Distance, grid: Grid
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V', 3) and triangles (F', 3) that follow the zero level more closely, closed as the given.

    normals: (U, 3) of the field at the first vertices; the others may be off the zero level and are moved
    onto it.
    """
    cell = float(grid.cell.min())
    step, given = NORMAL_STEP * cell, len(normals)
    more, of_more = _onto(distance, vertices[given:], np.full(len(vertices) - given, cell), step)
    vertices, normals = np.concatenate([vertices[:given], more]), np.concatenate([normals, of_more])
    settled, known = [], 0
    for _ in range(_PASSES):
        edges = _bent(faces, normals)
        # Those between older corners were looked at before, and what lies beyond them may be settled.
        edges = edges[edges[:, 1] >= known]
        ends = vertices[edges]
        middles = ends.mean(axis=1)
        off = np.abs(evaluate(distance, middles)) > _OFF * cell
        if not off.any():
            break
        furthest = _FURTHEST * lengths(ends[off, 1] - ends[off, 0])
        known = len(vertices)
        more, of_more = _onto(distance, middles[off], furthest, step)
        vertices, normals = np.concatenate([vertices, more]), np.concatenate([normals, of_more])
        whole, faces = _halved(faces, edges[off], vertices)
        settled.append(whole)
    return vertices, np.concatenate([*settled, faces])


def _onto(
    distance: Distance, points: np.ndarray, furthest: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) moved along the normals there, no further than (N,), to where the field is least; and the
    normals (N, 3)."""
    normals = field_normals(distance, points, step)
    value = evaluate(distance, points).astype(np.float64)
    along = np.zeros(len(points))
    best, least = along, value
    slope = np.ones(len(points))
    for _ in range(_STEPS):
        ahead = np.clip(along - value / slope, -furthest, furthest)
        there = evaluate(distance, points + ahead[:, None] * normals).astype(np.float64)
        run = ahead - along
        slope = np.where(run == 0, slope, np.maximum((there - value) / np.where(run == 0, 1, run), _FLATTEST))
        along, value = ahead, there
        nearer = np.abs(value) < np.abs(least)
        best, least = np.where(nearer, along, best), np.where(nearer, value, least)
    return points + best[:, None] * normals, normals


def _bent(faces: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Edges (E, 2), lower number first, between vertices whose normals differ."""
    ends = np.concatenate([faces[:, (0, 1)], faces[:, (1, 2)], faces[:, (2, 0)]])
    ends = ends[ends[:, 0] < ends[:, 1]]  # of a closed surface each edge runs there and back
    cosine = np.einsum("ed,ed->e", normals[ends[:, 0]], normals[ends[:, 1]])
    return ends[(cosine < _BENT) & (cosine > _OPPOSED)]


def _halved(faces: np.ndarray, edges: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles with none of these edges (E, 2), lower number first, and pieces of the others. The edges'
    middles are the last vertices."""
    first = len(vertices) - len(edges)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)])
    key = ends.min(axis=0) * first + ends.max(axis=0)
    known = edges[:, 0] * first + edges[:, 1]
    order = np.argsort(known)
    place = np.minimum(np.searchsorted(known, key, sorter=order), len(known) - 1)
    number = order[place]
    cut = known[number] == key
    middle, count = first + number, cut.sum(axis=1)
    # Turned so that one cut edge is the first, or of two that are cut the whole one.
    turn = np.where(count == 2, cut.argmin(axis=1), cut.argmax(axis=1))
    turned = (turn[:, None] + np.arange(3)) % 3
    corner, middle = np.take_along_axis(faces, turned, axis=1), np.take_along_axis(middle, turned, axis=1)
    corners = np.concatenate([corner, middle], axis=1)
    # Of two that are cut four corners are left, which the shorter diagonal halves.
    long, short = (vertices[corners[:, i]] - vertices[corners[:, j]] for i, j in ((0, 4), (1, 5)))
    kind = np.where((count == 2) & (lengths(short) < lengths(long)), _OTHER_WAY, count)
    pieces = [corners[kind == of][:, triangle] for of, triangles in _PIECES.items() for triangle in triangles]
    return faces[count == 0], np.concatenate(pieces)
