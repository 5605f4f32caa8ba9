"""Connectivity of triangles: edges, bodies, boundaries. Arrays in, arrays out; no geometry is changed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright import _kernel
from partwright.rows import crosses

_SHEET = 1e-4  # unit lengths: what is open and thinner is a flat sheet
_PLANE = 1e-6  # unit lengths: thickness under which points count as one plane


def area_vectors(corners: NDArray[Any]) -> NDArray[Any]:
    """Normals (F, 3) of triangles (F, 3, 3), each as long as twice its area."""
    return crosses(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def doubled_areas(vertices: NDArray[Any], faces: NDArray[Any]) -> NDArray[Any]:
    """Twice the area (F,) of each triangle, in squared units of the vertices (V, 3): enough for weights."""
    columns, (a, b, c) = np.ascontiguousarray(vertices.T), np.ascontiguousarray(faces.T)
    (ux, uy, uz), (wx, wy, wz) = ([k[end] - k[a] for k in columns] for end in (b, c))
    # As by `area_vectors`, but rows of three are slow to gather.
    return np.asarray(np.sqrt((uy * wz - uz * wy) ** 2 + (uz * wx - ux * wz) ** 2 + (ux * wy - uy * wx) ** 2))


def principal_axes(points: NDArray[Any]) -> NDArray[Any]:
    """(3, 3) unit vectors in columns, along which points (N, 3) spread least, more, and most."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1])


def plane_normal(points: NDArray[Any]) -> NDArray[Any]:
    """(3,) unit normal, either way, of the plane that lies best through points (N, 3)."""
    return principal_axes(points)[:, 0]


def thickness(points: NDArray[Any]) -> float:
    """Across the plane that lies best through points (N, 3), in their own units."""
    return float(np.ptp(points @ plane_normal(points)))


def is_sheet(points: NDArray[Any]) -> bool:
    """Whether points (N, 3), unit frame, of an open surface lie in a plane as nearly as it matters."""
    return thickness(points) < _SHEET


def is_plane(points: NDArray[Any]) -> bool:
    """Whether points (N, 3), unit frame, lie in one plane: what is closed may be thinner than a sheet."""
    return thickness(points) < _PLANE


@dataclass(frozen=True)
class EdgeTable:
    """The half-edges of faces (F, 3), grouped by the undirected edge they run along."""

    faces: NDArray[np.int64]

    @cached_property
    def _half_edges(self) -> NDArray[np.int64]:
        return self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)

    @cached_property
    def _sorted(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Order of the half-edges by undirected edge, and where each edge's group starts in that order."""
        start, end = self._half_edges.T
        low, high = np.minimum(start, end), np.maximum(start, end)
        key = low * (int(self.faces.max(initial=0)) + 1) + high
        order = np.argsort(key, kind="stable")
        key = key[order]
        return order, np.flatnonzero(np.r_[True, key[1:] != key[:-1]])

    @cached_property
    def valence(self) -> NDArray[np.int64]:
        """Triangles at each undirected edge (E,)."""
        order, start = self._sorted
        return np.diff(np.r_[start, len(order)])

    @cached_property
    def balance(self) -> NDArray[np.int64]:
        """Half-edges one way minus the other way (E,); all zero means closed and consistently wound."""
        order, start = self._sorted
        direction = np.where(self._half_edges[order, 0] < self._half_edges[order, 1], 1, -1)
        return np.add.reduceat(direction, start) if len(start) else np.zeros(0, dtype=np.int64)

    @cached_property
    def open_half_edges(self) -> NDArray[np.int64]:
        """Half-edges (B, 2) that have no partner at all."""
        order, start = self._sorted
        return self._half_edges[order[start[self.valence == 1]]]

    @cached_property
    def open_faces(self) -> NDArray[np.int64]:
        """Triangles with an edge that has no partner at all."""
        order, start = self._sorted
        return np.unique(order[start[self.valence == 1]] // 3)

    @cached_property
    def unbalanced_half_edges(self) -> NDArray[np.int64]:
        """The half-edges (B, 2) that outnumber those the other way, each as often as it does."""
        order, start = self._sorted
        edge = np.sort(self._half_edges[order[start]], axis=1)
        edge = np.where(self.balance[:, None] > 0, edge, edge[:, ::-1])
        return np.repeat(edge, np.abs(self.balance), axis=0)

    @cached_property
    def pairs(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Edges (P, 2) with two triangles, and those triangles (P, 2): the first runs along the edge."""
        order, start = self._sorted
        first = start[self.valence == 2]
        return self._half_edges[order[first]], np.stack([order[first] // 3, order[first + 1] // 3], axis=1)

    @cached_property
    def inconsistent_faces(self) -> NDArray[np.int64]:
        """Triangles at two-triangle edges that both run along the same way."""
        order, start = self._sorted
        first = start[(self.valence == 2) & (self.balance != 0)]
        return np.unique(np.r_[order[first], order[first + 1]] // 3)

    @cached_property
    def bodies(self) -> NDArray[np.int64]:
        """Body number (F,) of each triangle: bodies hang together by edges, not by single vertices."""
        order, start = self._sorted
        linked = np.ones(len(order), dtype=bool)
        linked[start] = False
        at = np.flatnonzero(linked)
        return components(len(self.faces), order[at - 1] // 3, order[at] // 3)

    @cached_property
    def patches(self) -> NDArray[np.int64]:
        """Patch number (F,) of each triangle: patches end at edges where more than two triangles meet."""
        return components(len(self.faces), *self.pairs[1].T)

    @cached_property
    def open_bodies(self) -> NDArray[np.bool_]:
        """Whether each body (number of bodies,) has an edge that is not balanced."""
        order, start = self._sorted
        is_open = np.zeros(int(self.bodies.max(initial=-1)) + 1, dtype=bool)
        is_open[self.bodies[order[start[self.balance != 0]] // 3]] = True
        return is_open


def compacted(faces: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The vertices (U,) of `count` that faces (F, 3) use, ascending, and the faces numbered by them."""
    is_used = np.zeros(count, dtype=bool)
    is_used[faces] = True
    return np.flatnonzero(is_used), (np.cumsum(is_used) - 1)[faces]


def components(count: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """Connected component (count,) of each node of the graph with edges a[i]-b[i], by their first nodes."""
    return _kernel.connected(np.stack([a, b], axis=1).astype(np.int64), count)


def boundary_loops(half_edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Vertex loops along half-edges (B, 2), of which as many leave each vertex as come to it.

    Unbalanced ones do. None passes a vertex twice: a rim that touches itself comes as several.
    """
    follow: dict[int, list[int]] = {}
    for start, end in half_edges[np.lexsort(half_edges.T)][::-1].tolist():
        follow.setdefault(start, []).append(end)
    loops = []
    for first in sorted(follow):
        while follow[first]:
            walk, place = [first], {first: 0}
            while (following := follow[walk[-1]].pop()) != first:
                if following in place:
                    loops.append(walk[place[following] :])
                    for vertex in walk[place[following] + 1 :]:
                        del place[vertex]
                    del walk[place[following] + 1 :]
                else:
                    place[following] = len(walk)
                    walk.append(following)
            loops.append(walk)
    return [np.array(loop, dtype=np.int64) for loop in loops]


def signed_volumes(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], label: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Volume enclosed by each labelled set of triangles, negative where it is inside out.

    Measured from the set's own area centroid, so that it also tells the facing of a set with openings.
    """
    corners = vertices[faces]
    normal = area_vectors(corners)
    area = np.linalg.norm(normal, axis=1)
    centroid = corners.mean(axis=1)
    count = int(label.max(initial=-1)) + 1
    total = np.maximum(np.bincount(label, area, count), np.finfo(np.float64).tiny)
    middle = np.stack([np.bincount(label, area * centroid[:, k], count) / total for k in range(3)], axis=1)
    flux = ((centroid - middle[label]) * normal).sum(axis=1)
    return np.bincount(label, flux, count) / 6
