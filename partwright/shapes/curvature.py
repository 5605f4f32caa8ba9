"""Principal curvature of a triangle mesh, averaged over a small neighbourhood so that slivers do not matter.

Normal cycles (Cohen-Steiner & Morvan 2003, "Restricted Delaunay triangulations and normal cycle"): the
curvature tensor of a region is the sum over its edges of dihedral angle * length * (e x e), divided by the
region's area. It is an integral, so it does not depend on how the surface is cut into triangles. Edges and
area are collected on a coarse grid and smoothed there; a sharp edge therefore reads about 1 / (size of the
neighbourhood), never infinity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.topology import EdgeTable, area_vectors

_CELL = 0.04  # unit frame: the neighbourhood is about two cells wide
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


class CurvatureField:
    """Largest absolute principal curvature near a surface, in 1/unit length."""

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        area_points: NDArray[np.float64],
        area: float,
    ) -> None:
        """Vertices (V, 3) and faces (F, 3) in the unit frame; area_points (N, 3) sample their area."""
        from scipy.ndimage import gaussian_filter

        self._origin = vertices.min(axis=0) - 3 * _CELL
        sides = np.ceil((vertices.max(axis=0) - self._origin) / _CELL).astype(int) + 3
        shape = (int(sides[0]), int(sides[1]), int(sides[2]))
        where, weight, direction = _bent_edges(vertices, faces)
        share = np.full(len(area_points), area / max(len(area_points), 1))
        layers = [self._collect(where, weight * direction[:, i] * direction[:, j], shape) for i, j in _PAIRS]
        layers.append(self._collect(area_points, share, shape))
        smooth = [gaussian_filter(layer, 0.8, mode="constant") for layer in layers]
        covered = smooth[-1] > 1e-3 * smooth[-1].max()
        self._tensor = [np.divide(s, smooth[-1], out=np.zeros(shape), where=covered) for s in smooth[:-1]]

    def _collect(
        self, points: NDArray[np.float64], value: NDArray[np.float64], shape: tuple[int, int, int]
    ) -> NDArray[np.float64]:
        cell = np.round((points - self._origin) / _CELL).astype(np.int64)
        flat = np.ravel_multi_index(tuple(cell.T), shape)
        return np.bincount(flat, value, int(np.prod(shape))).astype(np.float64).reshape(shape)

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Curvature (N,) at surface points (N, 3)."""
        from scipy.ndimage import map_coordinates

        place = ((points - self._origin) / _CELL).T
        tensor = np.empty((len(points), 3, 3))
        for (i, j), layer in zip(_PAIRS, self._tensor, strict=True):
            tensor[:, i, j] = tensor[:, j, i] = map_coordinates(layer, place, order=1)
        return np.abs(np.linalg.eigvalsh(tensor)).max(axis=1)


def _bent_edges(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Pieces of bent edges, at most a cell long: midpoints (P, 3), angle * length (P,), directions (P, 3)."""
    edge, beside = EdgeTable(faces).pairs
    left, right = beside.T
    corners = vertices[faces]
    normal = units(area_vectors(corners))
    along = vertices[edge[:, 1]] - vertices[edge[:, 0]]
    length = np.linalg.norm(along, axis=1)
    direction = along / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    turn = (np.cross(normal[left], normal[right]) * direction).sum(axis=1)
    angle = np.arctan2(turn, (normal[left] * normal[right]).sum(axis=1))  # convex positive
    bent = np.abs(angle) * length > 0
    pieces = np.ceil(length[bent] / _CELL).astype(np.int64)
    owner = np.repeat(np.flatnonzero(bent), pieces)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    fraction = (number + 0.5) / np.repeat(pieces, pieces)
    where = vertices[edge[owner, 0]] + fraction[:, None] * along[owner]
    return where, angle[owner] * length[owner] / np.repeat(pieces, pieces), direction[owner]
