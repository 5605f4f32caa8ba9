"""Chamfer distance between the sharp edges of two surfaces."""

from __future__ import annotations

import math

import numpy as np

from partwright.metrics.chamfer import chamfer

THRESHOLD = 0.1
RADIUS = 0.018  # unit frame: BSP-Net's 0.01 in a box of side 1
SPACINGS = 4.0  # mean distances to the nearest sample: too few points for that radius get a larger one
_NEIGHBOURS = 24


def edge_chamfer(
    first: np.ndarray, first_normals: np.ndarray, second: np.ndarray, second_normals: np.ndarray
) -> float:
    """`edge_chamfer`: the Chamfer distance between those samples of each surface that lie near an edge
    (CAPRI-Net, section 4.2, after BSP-Net).

    0 where neither surface has an edge, infinite where only one has.

    first, second: (N, 3) and (M, 3) points, unit frame; normals: unit vectors at them.
    """
    spacing = max(_spacing(first), _spacing(second))
    edges = [
        points[near_edges(points, normals, max(RADIUS, SPACINGS * spacing))]
        for points, normals in ((first, first_normals), (second, second_normals))
    ]
    if not all(map(len, edges)):
        return math.inf if any(map(len, edges)) else 0.0
    return chamfer(*edges)


def _spacing(points: np.ndarray) -> float:
    from scipy.spatial import cKDTree

    return float(cKDTree(points).query(points, k=2)[0][:, 1].mean())


def near_edges(
    points: np.ndarray, normals: np.ndarray, radius: float = RADIUS, threshold: float = THRESHOLD
) -> np.ndarray:
    """(N,) bool: whether one of the 24 nearest points, within `radius`, has a normal whose |cosine| to this
    point's is under the threshold."""
    from scipy.spatial import cKDTree

    count = min(_NEIGHBOURS, len(points))
    distance, index = cKDTree(points).query(points, k=count, distance_upper_bound=radius)
    found = np.isfinite(distance)
    other = normals[np.where(found, index, 0)]
    cosine = np.abs(np.einsum("nd,nkd->nk", normals, other))
    return np.asarray((np.where(found, cosine, 1.0) < threshold).any(axis=1))
