"""How rough a shape's own surface is: what no smooth part can follow."""

from __future__ import annotations

import numpy as np

from partwright.shapes import Shape

_POINTS = 30_000
_PATCHES = 1_000
_AROUND = 32  # samples of a patch: about 0.04 unit lengths wide
_LOOKED = 96  # samples around its middle, among which those are that look the same way
_ALIKE = 0.5  # cosine


def roughness(shape: Shape) -> float:
    """Standard deviation of the surface off a quadric through its neighbourhood, in unit lengths.

    The median over patches all over the surface. A patch is of what looks the same way as its middle: the
    other side of a thin wall is no noise, and neither is what lies beyond an edge.
    """
    from scipy.spatial import cKDTree

    surface = shape.unit_surface(_POINTS, seed=17)
    points, normals = surface.points.astype(np.float64), surface.normals
    centres = np.arange(0, len(points), max(1, len(points) // _PATCHES))
    found = cKDTree(points).query(points[centres], _LOOKED)[1]
    alike = np.einsum("nki,ni->nk", normals[found], normals[centres]) > _ALIKE
    first = np.argsort(~alike, axis=1, kind="stable")[:, :_AROUND]
    whole = alike.sum(axis=1) >= _AROUND
    near = points[np.take_along_axis(found, first, axis=1)[whole if whole.any() else slice(None)]]
    local = near - near.mean(axis=1, keepdims=True)
    axes = np.linalg.svd(local, full_matrices=False)[2]
    u, v, height = np.moveaxis(local @ axes.transpose(0, 2, 1), -1, 0)
    basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)
    scale = np.maximum(np.abs(basis).max(axis=1, keepdims=True), 1e-12)
    coefficients = np.linalg.pinv(basis / scale) @ height[..., None]
    left = height - ((basis / scale) @ coefficients)[..., 0]
    free = _AROUND - basis.shape[-1]
    return float(np.median(np.sqrt((left * left).sum(axis=1) / free)))
