"""Small components: what is left of a sheet that is thinner than the grid can show."""

from __future__ import annotations

import numpy as np

from partwright import _kernel


def components(faces: np.ndarray, count: int) -> tuple[int, np.ndarray]:
    """How many components faces (F, 3) between `count` vertices V make, and which each vertex (V,) is of."""
    piece = _kernel.connected(np.ascontiguousarray(faces, dtype=np.int64), count)
    return int(piece.max(initial=-1)) + 1, piece


def without_small_components(
    vertices: np.ndarray, faces: np.ndarray, shortest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and faces (F, 3) without components shorter than a length along all axes.

    Where all are that small, nothing is dropped.
    """
    pieces, piece = components(faces, len(vertices))
    order = np.argsort(piece, kind="stable")
    first = np.searchsorted(piece[order], np.arange(pieces))
    size = np.maximum.reduceat(vertices[order], first) - np.minimum.reduceat(vertices[order], first)
    large = np.asarray((size >= shortest).any(axis=1))
    if large.all() or not large.any():
        return vertices, faces
    kept = large[piece]
    number = np.cumsum(kept) - 1
    return vertices[kept], number[faces[kept[faces[:, 0]]]]
