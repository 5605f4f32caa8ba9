"""Faces cut along the borders between parts, so that a coarse triangle need not belong to one part alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly

_PASSES = 8  # halvings of what straddles a border
_SPACING = 0.02  # of the longest side: shorter edges are not halved any more

# corners 0, 1, 2 and points 3, 4, 5 on the edges 01, 12, 20; which of these edges are cut -> triangles
_PATTERNS: dict[int, list[tuple[int, int, int]]] = {
    0b000: [(0, 1, 2)],
    0b001: [(0, 3, 2), (3, 1, 2)],
    0b010: [(0, 1, 4), (0, 4, 2)],
    0b100: [(0, 1, 5), (5, 1, 2)],
    0b011: [(3, 1, 4), (0, 3, 4), (0, 4, 2)],
    0b110: [(5, 4, 2), (0, 1, 4), (0, 4, 5)],
    0b101: [(0, 3, 5), (3, 1, 2), (3, 2, 5)],
    0b111: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
}


def split_at_borders(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], assembly: Assembly
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Vertices (V, 3), faces (F, 3), and which face (F,) each was cut from; the surface stays the same.

    Faces that straddle a border are halved until they are small, then all edges whose ends are nearest to
    different parts are cut where both are equally near. Neighbours are cut at the same points, so that what
    was closed stays closed.
    """
    source = np.arange(len(faces))
    longest = float(np.ptp(vertices, axis=0).max())
    for _ in range(_PASSES):
        away = np.abs(assembly.part_distances(vertices))
        ends, edges = _edges(faces)
        long = np.linalg.norm(np.diff(vertices[ends], axis=1)[:, 0], axis=1) > _SPACING * longest
        wanted = np.zeros(len(ends), bool)
        wanted[edges[_straddling(vertices, faces, away, assembly)]] = True
        if not (wanted & long).any():
            break
        middles = vertices[ends].mean(axis=1)
        vertices, faces, source = _cut(vertices, faces, source, edges, wanted & long, middles)
    away = np.abs(assembly.part_distances(vertices))
    ends, edges = _edges(faces)
    nearest = away.argmin(axis=0)
    a, b = ends.T
    first, last = nearest[a], nearest[b]
    at_a, at_b = away[last, a] - away[first, a], away[first, b] - away[last, b]
    share = at_a / np.maximum(at_a + at_b, 1e-300)
    wanted = (first != last) & (share > 0.02) & (share < 0.98)  # beside a corner there is nothing to cut off
    return _cut(
        vertices, faces, source, edges, wanted, vertices[a] + share[:, None] * (vertices[b] - vertices[a])
    )


def _straddling(vertices: NDArray, faces: NDArray, away: NDArray, assembly: Assembly) -> NDArray[np.bool_]:
    """(F,) whether corners and middle are not all nearest to the same part."""
    middle = np.abs(assembly.part_distances(vertices[faces].mean(axis=1))).argmin(axis=0)
    return (away.argmin(axis=0)[faces] != middle[:, None]).any(axis=1)


def _edges(faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The edges (E, 2), and their numbers (F, 3) along each face: 01, 12, 20."""
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    ends, number = np.unique(pairs, axis=0, return_inverse=True)
    return ends, number.reshape(-1, 3)


def _cut(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    source: NDArray[np.int64],
    edges: NDArray[np.int64],
    wanted: NDArray[np.bool_],
    points: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """The wanted edges cut at their points (E, 3)."""
    number = np.full(len(wanted), -1)
    number[wanted] = len(vertices) + np.arange(np.count_nonzero(wanted))
    six = np.hstack([faces, number[edges]])
    pattern = wanted[edges] @ [1, 2, 4]
    order, cut, origin = [], [], []
    for key, triangles in _PATTERNS.items():
        members = np.flatnonzero(pattern == key)
        for triangle in triangles:
            order.append(members)
            cut.append(six[members][:, triangle])
            origin.append(source[members])
    place = np.argsort(np.concatenate(order), kind="stable")
    return np.vstack([vertices, points[wanted]]), np.vstack(cut)[place], np.concatenate(origin)[place]
