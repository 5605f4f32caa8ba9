"""What of a surface that passes through itself, or is open, parts inside from outside.

Faces of one body run on within another. A large one may be hidden in the middle and at all of its corners and
show in between, so each is looked at in pieces, the smaller the nearer they are to where it goes in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.distance import MeshDistance
from partwright.shapes.topology import area_vectors

_SIDE_STEP = 2e-5  # unit lengths: how far off a triangle its two sides are looked at
_PLACES = np.array([[1 / 3, 1 / 3, 1 / 3], [0.9, 0.05, 0.05], [0.05, 0.9, 0.05], [0.05, 0.05, 0.9]])
_ALIKE, _MIXED = 0.2, 0.05  # unit lengths: pieces that are alike all over, or not, are at most as long


class OuterFaces(NamedTuple):
    """faces: (F, 3) of the vertices (V, 3), facing outwards. hidden, cut: triangles given that are no part of
    it, and of which only pieces are."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    hidden: int
    cut: int


def outer_faces(source: MeshDistance, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> OuterFaces:
    """Of triangles (F, 3) with vertices (V, 3) in the unit frame, whose inside the source tells.

    Those that part inside from outside all over stay whole.
    """
    left, of = faces, np.arange(len(faces))
    looked_at: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]] = []
    points = vertices
    while len(left):
        corners = points[left]
        longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        settled = longest <= _MIXED
        way = np.zeros(len(left), np.int64)
        way[settled] = facing(source, corners[settled])  # most, of fine meshes: at one place, mostly
        large = np.flatnonzero(~settled)
        each = _facing_at(source, corners[large], _PLACES)
        way[large] = each[:, 0]
        settled[large] = (each == each[:, :1]).all(axis=1) & (longest[large] <= _ALIKE)
        looked_at.append((left[settled], of[settled], way[settled]))
        points, left = halved(points, left[~settled])
        of = np.repeat(of[~settled], 2)
    pieces, of, parting = (np.concatenate(one) for one in zip(*looked_at, strict=True))
    shown = np.bincount(of[parting != 0], minlength=len(faces))
    whole = shown == np.bincount(of, minlength=len(faces))
    way = np.bincount(of, parting, len(faces)).astype(np.int64)
    partly = (parting != 0) & ~whole[of]
    found = np.concatenate([_turned(faces, way)[whole], _turned(pieces, parting)[partly]])
    used, numbered = np.unique(found[found >= len(vertices)], return_inverse=True)
    found[found >= len(vertices)] = len(vertices) + numbered
    hidden = int(np.count_nonzero(shown == 0))
    return OuterFaces(
        np.concatenate([vertices, points[used]]), found, hidden, len(faces) - hidden - int(whole.sum())
    )


def facing(source: MeshDistance, corners: NDArray[np.float64]) -> NDArray[np.int64]:
    """+1 where a triangle (F, 3, 3) parts inside from outside and faces out, -1 where it faces in, 0 where it
    parts nothing: looked at in its middle and near its corners."""
    found = np.zeros(len(corners), np.int64)
    for place in _PLACES:
        rest = np.flatnonzero(found == 0)
        found[rest] = _facing_at(source, corners[rest], place[None])[:, 0]
    return found


def _facing_at(
    source: MeshDistance, corners: NDArray[np.float64], places: NDArray[np.float64]
) -> NDArray[np.int64]:
    """The same (F, P) at each of some places (P, 3) alone, which are weights of the corners."""
    step = _SIDE_STEP * units(area_vectors(corners))[:, None]
    place = np.einsum("fcd,pc->fpd", corners, places)
    sides = np.concatenate([place - step, place + step]).reshape(-1, 3)
    behind, before = source.inside(sides).astype(np.int64).reshape(2, len(corners), len(places))
    return np.asarray(behind - before)


def _turned(faces: NDArray[np.int64], way: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.where(way[:, None] < 0, faces[:, ::-1], faces)


def halved(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Each triangle in two (2 F, 3), side by side, across its longest side; and vertices with the middles."""
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).argmax(axis=1)
    a, b, c = np.take_along_axis(faces, (longest[:, None] + np.arange(3)) % 3, axis=1).T
    sides, numbered = np.unique(np.sort(np.stack([a, b], axis=1), axis=1), axis=0, return_inverse=True)
    middle = len(vertices) + numbered.reshape(-1)
    halves = np.stack([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)], axis=1)
    return np.concatenate([vertices, vertices[sides].mean(axis=1)]), halves.reshape(-1, 3)
