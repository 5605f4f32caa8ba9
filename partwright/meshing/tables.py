"""The marching cubes table, derived instead of copied.

A cell has eight corners, numbered by the bits x + 2 y + 4 z, and twelve edges, four along each axis. For each
of the 256 sign patterns the surface meets the cell's six faces in segments; where a face is ambiguous the
segments always cut off the inside corners, so that two cells agree about the face they share. Chained, the
segments make closed loops around the cell. A loop is cut into triangles without ever joining two points of
one face by a diagonal, since the neighbour might use the same diagonal. Both rules together make the surface
a closed two-manifold for every field (each edge has exactly two triangles, each point one fan).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
EDGES = np.array([(c, c | 1 << axis) for axis in range(3) for c in range(8) if not c >> axis & 1])
EDGE_AXIS = np.repeat(np.arange(3), 4)

Loop = tuple[int, ...]
Triangle = tuple[int, int, int]


@dataclass(frozen=True)
class LoopTable:
    """Loops of every sign pattern (bit c of the pattern is set where corner c is inside).

    count: (256,) number of loops; length: (256, L) points of each loop; edges: (256, L, P) the cell edges
    they lie on, in order, counter-clockwise seen from outside, padded with 0; triangles: (256, L, P - 2, 3)
    places within the loop.
    """

    count: np.ndarray
    length: np.ndarray
    edges: np.ndarray
    triangles: np.ndarray


def _faces() -> list[list[int]]:
    """The corners of each face, counter-clockwise seen from outside the cell."""
    faces = []
    for axis in range(3):
        u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        ring = [0, u, u | v, v]
        faces.append(ring[::-1])
        faces.append([c | 1 << axis for c in ring])
    return faces


def _loops(pattern: int) -> list[Loop]:
    edge_of = {frozenset(map(int, pair)): number for number, pair in enumerate(EDGES)}
    following: dict[int, int] = {}
    for ring in _faces():
        inside = [bool(pattern >> c & 1) for c in ring]
        for start in range(4):
            if inside[start - 1] or not inside[start]:
                continue
            end = start
            while inside[(end + 1) % 4]:
                end += 1
            entry = edge_of[frozenset((ring[start - 1], ring[start]))]
            leave = edge_of[frozenset((ring[end % 4], ring[(end + 1) % 4]))]
            following[entry] = leave
    loops = []
    while following:
        loop = [next(iter(following))]
        while (after := following.pop(loop[-1])) != loop[0]:
            loop.append(after)
        loops.append(tuple(loop))
    return loops


def _share_a_face(first: int, second: int) -> bool:
    corners = CORNERS[[*EDGES[first], *EDGES[second]]]
    return bool((corners == corners[0]).all(axis=0).any())


def _triangulate(loop: Loop, places: tuple[int, ...]) -> list[Triangle] | None:
    """Cut the polygon at `places` of `loop` into triangles whose diagonals stay off the cell's faces."""
    if len(places) == 2:
        return []
    first, last = places[0], places[-1]
    for middle in range(1, len(places) - 1):
        chords = [(first, places[middle])] if middle > 1 else []
        chords += [(places[middle], last)] if middle < len(places) - 2 else []
        if any(_share_a_face(loop[a], loop[b]) for a, b in chords):
            continue
        left = _triangulate(loop, places[: middle + 1])
        right = _triangulate(loop, places[middle:])
        if left is not None and right is not None:
            return [(first, places[middle], last), *left, *right]
    return None


@lru_cache(maxsize=1)
def loop_table() -> LoopTable:
    """Build the table (8 ms, once)."""
    loops = [_loops(pattern) for pattern in range(256)]
    most = max(len(found) for found in loops)
    longest = max(len(loop) for found in loops for loop in found)
    count = np.array([len(found) for found in loops])
    length = np.zeros((256, most), dtype=np.int64)
    edges = np.zeros((256, most, longest), dtype=np.int64)
    triangles = np.zeros((256, most, longest - 2, 3), dtype=np.int64)
    for pattern, found in enumerate(loops):
        for number, loop in enumerate(found):
            cut = _triangulate(loop, tuple(range(len(loop))))
            assert cut is not None, "every loop can be cut without a diagonal on a face"
            length[pattern, number] = len(loop)
            edges[pattern, number, : len(loop)] = loop
            triangles[pattern, number, : len(cut)] = cut
    return LoopTable(count, length, edges, triangles)
