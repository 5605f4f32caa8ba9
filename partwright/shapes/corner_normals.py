"""Normals for smooth shading that keep creases sharp."""

from __future__ import annotations

import numpy as np

from partwright.rows import lengths
from partwright.shapes.topology import area_vectors

_CREASE = 0.77  # cosine of the angle between faces (about 40 degrees) beyond which an edge stays sharp
_CROWDED = 256  # at a corner of more faces than this, flat shading is all there is time for


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3) normals whose length is twice the face's area."""
    return area_vectors(vertices.take(faces, axis=0))


def corner_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3, 3) float32: at each corner of each face, the mean normal of the faces there that lie on the same
    side of every crease, weighted by area."""
    weighted = face_normals(vertices, faces)
    unit = _normalised(weighted)
    corner = faces.ravel()
    smooth = _normalised(_sums(np.repeat(weighted, 3, axis=0), corner, len(vertices)))
    result = smooth[faces].reshape(-1, 3)
    turned = np.einsum("nd,nd->n", result, np.repeat(unit, 3, axis=0)) < (1 + _CREASE) / 2
    creased = np.zeros(len(vertices), dtype=bool)
    creased[corner[turned]] = True
    at_crease = np.flatnonzero(creased[corner])
    if len(at_crease):
        result[at_crease] = _one_sided(weighted, unit, corner, at_crease)
    return result.reshape(-1, 3, 3).astype(np.float32)


def _one_sided(weighted: np.ndarray, unit: np.ndarray, corner: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Normals (K, 3) of the chosen corners: means over the faces at the same vertex that are turned alike."""
    chosen_by_vertex = chosen[np.argsort(corner[chosen], kind="stable")]
    _, first, count = np.unique(corner[chosen_by_vertex], return_index=True, return_counts=True)
    first, count = first[count <= _CROWDED], count[count <= _CROWDED]
    # All pairs of corners at each vertex.
    pairs = count * count
    vertex = np.repeat(np.arange(len(count)), pairs)
    number = np.arange(len(vertex)) - (np.cumsum(pairs) - pairs)[vertex]
    one = chosen_by_vertex[first[vertex] + number // count[vertex]]
    other = chosen_by_vertex[first[vertex] + number % count[vertex]]
    alike = np.einsum("nd,nd->n", unit[one // 3], unit[other // 3]) > _CREASE
    sums = _sums(weighted[other[alike] // 3], one[alike], len(corner))[chosen]
    found = np.abs(sums).sum(axis=1, keepdims=True) > 0
    return np.where(found, _normalised(sums), unit[chosen // 3])


def _sums(vectors: np.ndarray, group: np.ndarray, groups: int) -> np.ndarray:
    """(groups, 3) sums of the vectors (N, 3) of each group (N,)."""
    return np.stack([np.bincount(group, vectors[:, i], groups) for i in range(3)], axis=1)


def _normalised(vectors: np.ndarray) -> np.ndarray:
    length = lengths(vectors)[..., None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
