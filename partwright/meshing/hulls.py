"""Convex hulls, by the compiled kernel: closed and nowhere concave, whatever lies in one plane.

manifold3d's own now and then fold over themselves where many points are nearly in one plane, a few in a
hundred by up to a sixth of their volume.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from partwright import _kernel
from partwright.meshing.manifolds import closed, surface_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_BITS = 21  # of a file's coordinates: single precision has 24, and the others keep corners apart


def hull_of(points: np.ndarray) -> Manifold:
    """The hull of points (N, 3); empty where they lie in one plane."""
    from manifold3d import Manifold

    points = _checked(points)
    faces, _ = _kernel.convex_hull(points, True)
    if not len(faces):
        return Manifold()
    corners, places = np.unique(faces, return_inverse=True)
    return closed(points[corners], places.reshape(-1, 3))


def file_grid(points: np.ndarray) -> float:
    """Between the places that `file_hull` moves points (N, 3) to, along each axis: a length."""
    largest = float(np.abs(points).max(initial=0.0))
    return float(np.ldexp(1.0, math.frexp(largest)[1] - _BITS)) if largest > 0 else 0.0


def file_hull(points: np.ndarray) -> Manifold:
    """The hull of points (N, 3) moved by up to half a millionth of the largest coordinate along each axis, to
    where single precision has a place: a file that keeps no more holds it as it is, closed and nowhere
    concave. Corners that files round by themselves turn narrow triangles out of their planes.

    What is so thin that nothing is left stays where it is.
    """
    hull = hull_of(points)
    corners = surface_of(hull)[0]  # what lies between them, moved, would become one
    grid = file_grid(corners)
    if grid == 0:
        return hull
    moved = hull_of(np.rint(corners / grid) * grid)
    return hull if moved.is_empty() else moved


def hull_volume(points: np.ndarray) -> float:
    """Volume of the hull of points (N, 3)."""
    return _kernel.convex_hull(_checked(points), False)[1]


def split_hull_volumes(
    vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray, planes: np.ndarray, slack: float
) -> np.ndarray:
    """(P,) volume of the hulls of a closed mesh's two sides of each plane, together; infinite where one side
    has nothing.

    edges: (E, 2), each once. planes: (P, 4) unit normals and offsets. slack: what is no farther from a plane
    lies in it.
    """
    return _kernel.split_hull_volumes(
        _checked(vertices),
        np.ascontiguousarray(faces, dtype=np.int64),
        np.ascontiguousarray(edges, dtype=np.int64),
        np.ascontiguousarray(planes, dtype=np.float64),
        slack,
    )


def _checked(points: np.ndarray) -> np.ndarray:
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must be (N, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("points must be finite")
    return array
