"""Which part a point of an assembly's surface is shown in the colour of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from partwright.assembly import Assembly
    from partwright.render.raycast import Hits

_TIE = 2e-3  # of the longest side of what is seen: surfaces nearer to each other than this are one to the eye
_ASIDE = 5.0  # ties away: where surfaces that only cross at a point are apart again
_AT_ONCE = 1 << 16  # points, so that distances to hundreds of parts fit


def hit_parts(assembly: Assembly, hits: Hits) -> np.ndarray:
    """`surface_parts` at what rays hit: labels for `look`, by which `palette` gives the colours."""
    return surface_parts(assembly, hits.point, hits.normal)


def surface_parts(assembly: Assembly, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N,) the leaf whose own surface runs along that of the assembly at each point (N, 3) with its normal.

    So the wall of a hole is the cut's, a face of a convex the half-space's. Of several such leaves it is the
    first, so that a face that parts share is of one colour.
    """
    if len(assembly) == 1 or not len(points):
        return np.zeros(len(points), np.int64)
    tie = _TIE * float(np.ptp(points, axis=0).max())
    result = np.empty(len(points), np.int64)
    for start in range(0, len(points), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        result[some] = _owners(assembly, points[some], normals[some], tie)
    return result


def _owners(assembly: Assembly, points: np.ndarray, normals: np.ndarray, tie: float) -> np.ndarray:
    off = np.abs(assembly.part_distances(points))
    near = off <= off.min(axis=0) + tie
    shared = np.flatnonzero(near.sum(axis=0) > 1)
    if len(shared):
        along = _off_beside(assembly, points[shared], normals[shared], _ASIDE * tie)
        along[~near[:, shared]] = np.inf
        near[:, shared] = along <= along.min(axis=0) + tie
    return near.argmax(axis=0)


def _off_beside(assembly: Assembly, points: np.ndarray, normals: np.ndarray, far: float) -> np.ndarray:
    """(M, N) mean distance of leaves from four places beside each point, on its tangent plane."""
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    one = np.cross(normals, axis)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(normals, one)
    aside = far * np.stack([one, -one, other, -other])
    return np.mean([np.abs(assembly.part_distances(points + step)) for step in aside], axis=0)
