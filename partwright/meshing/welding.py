"""Corners of one place as one corner: what is left between them is no surface, and files without indices
(STL) join them anyway."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_DIGITS = 2.0**-22  # of the largest coordinate: two steps of the single precision that files keep


def welded(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and faces (F, 3) of a closed surface with corners joined that are one in a file,
    without the flat pairs of triangles that then lie back to back.

    As given where that would leave an edge that is not between two faces: bodies that touch in an edge.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    near = cKDTree(vertices).query_pairs(
        _DIGITS * float(np.abs(vertices).max(initial=0.0)), output_type="ndarray"
    )
    if not len(near):
        return vertices, faces
    links = coo_array((np.ones(len(near), bool), near.T), shape=(len(vertices),) * 2)
    _, place = connected_components(links, directed=False)
    joined = place[faces]
    joined = joined[(joined != np.roll(joined, 1, axis=1)).all(axis=1)]
    joined = joined[_outweighing(joined)]
    if not _closed(joined):
        return vertices, faces
    used, number = np.unique(joined, return_inverse=True)
    _, first = np.unique(place, return_index=True)
    return vertices[first[used]], number.reshape(joined.shape)


def _outweighing(faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,) which faces no other of the same corners makes up for that looks the other way."""
    _, kind = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    kind = kind.reshape(-1)
    way = (faces[:, 0] < faces[:, 1]) ^ (faces[:, 1] < faces[:, 2]) ^ (faces[:, 2] < faces[:, 0])
    counts = np.bincount(2 * kind + way, minlength=2 * (int(kind.max(initial=-1)) + 1)).reshape(-1, 2)
    left = np.maximum(counts - counts[:, ::-1], 0).ravel()
    code = 2 * kind + way
    order = np.argsort(code, kind="stable")
    rank = np.empty(len(faces), np.int64)
    rank[order] = np.arange(len(faces)) - np.searchsorted(code[order], code[order])
    return np.asarray(rank < left[code])


def _closed(faces: NDArray[np.int64]) -> bool:
    """Whether every edge is between two faces."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    return bool(len(count) and (count == 2).all())
