"""Normals for smooth shading that keep creases sharp."""

from __future__ import annotations

import numpy as np

_CREASE = 0.77  # cosine of the angle between faces (about 40 degrees) beyond which an edge stays sharp
_CROWDED = 256  # at a corner of more faces than this, flat shading is all there is time for


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3) normals whose length is twice the face's area."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def corner_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3, 3) float32: at each corner of each face, the mean normal of the faces there that lie on the same
    side of every crease, weighted by area."""
    weighted = face_normals(vertices, faces)
    length = np.linalg.norm(weighted, axis=1, keepdims=True)
    unit = np.divide(weighted, length, out=np.zeros_like(weighted), where=length > 0)
    corner = faces.ravel()
    mean = np.stack(
        [np.bincount(corner, np.repeat(weighted[:, i], 3), len(vertices)) for i in range(3)], axis=1
    )
    mean = _normalised(mean)
    result = mean[faces]

    # At a vertex with a crease each corner takes the mean over its own side.
    turned = np.einsum("fcd,fd->fc", result, unit).ravel() < (1 + _CREASE) / 2
    creased = np.zeros(len(vertices), dtype=bool)
    creased[corner[turned]] = True
    involved = np.flatnonzero(creased[corner])
    involved = involved[np.argsort(corner[involved], kind="stable")]
    _, first, count = np.unique(corner[involved], return_index=True, return_counts=True)
    result.reshape(-1, 3)[involved] = unit[involved // 3]
    few = count <= _CROWDED
    first, count = first[few], count[few]
    pairs = count * count
    vertex = np.repeat(np.arange(len(count)), pairs)
    number = np.arange(len(vertex)) - (np.cumsum(pairs) - pairs)[vertex]
    one = involved[first[vertex] + number // count[vertex]]
    other = involved[first[vertex] + number % count[vertex]]
    near = np.einsum("nd,nd->n", unit[one // 3], unit[other // 3]) > _CREASE
    one, other = one[near], other[near]
    sums = np.stack(
        [np.bincount(one, weighted[other // 3, i], len(corner)) for i in range(3)], axis=1
    )[involved]
    known = np.abs(sums).sum(axis=1) > 0
    result.reshape(-1, 3)[involved[known]] = _normalised(sums[known])
    return result.astype(np.float32)


def _normalised(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
