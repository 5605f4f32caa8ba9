"""Planes that may cut a solid well, and what the hulls of its two sides would be, without cutting it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.hulls import split_hull_volumes
from partwright.meshing.manifolds import surface_of
from partwright.shapes.topology import area_vectors, doubled_areas

if TYPE_CHECKING:
    from manifold3d import Manifold

_SHARES = (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875)  # of the extent along an axis
_MOST = 24  # planes along concave edges
_CONCAVE = 0.08  # radians by which an edge is concave at least
_HALVING = 0.9  # of a plane that halves an angle, beside one that continues a face: pieces stay square
_SAME = (0.05, 0.01)  # normals, and offsets over the size, that count as the same plane
_TURNS = (0.2, 0.1, 0.05, 0.025, 0.0125)  # radians, by which a plane is turned
_SHIFT = 0.3  # of the size for a radian, by which it is moved
_SLACK = 1e-7  # of the size: what is no farther from a plane lies in it
_LESS = 1e-4  # of the hulls: what moves for less stays

Plane = tuple[np.ndarray, float]


@dataclass(frozen=True, eq=False)
class Corners:
    """A closed mesh as arrays. vertices: (V, 3). edges: (E, 2), each once, with the two faces (E, 2) beside
    it."""

    vertices: np.ndarray
    faces: np.ndarray
    edges: np.ndarray
    beside: np.ndarray

    @classmethod
    def of(cls, solid: Manifold) -> Corners:
        vertices, faces = surface_of(solid)
        directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        owner = np.repeat(np.arange(len(faces)), 3)
        forward = directed[:, 0] < directed[:, 1]
        keys = np.sort(directed, axis=1) @ (len(vertices), 1)
        first, second = np.argsort(keys[forward], kind="stable"), np.argsort(keys[~forward], kind="stable")
        edges = directed[forward][first]
        beside = np.stack([owner[forward][first], owner[~forward][second]], axis=1)
        return cls(vertices, faces, edges, beside)

    @cached_property
    def size(self) -> float:
        return float(np.ptp(self.vertices, axis=0).max())

    @cached_property
    def normals(self) -> np.ndarray:
        """(F, 3) unit normals; zero for triangles without area."""
        normal = area_vectors(self.vertices[self.faces])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)

    @cached_property
    def axes(self) -> np.ndarray:
        """(3, 3) principal axes of the surface, in rows, the longest first."""
        area = doubled_areas(self.vertices, self.faces)
        a, b, c = self.vertices[self.faces.T]
        middle = (a + b + c) / 3
        centred = middle - np.average(middle, axis=0, weights=area)
        return np.linalg.eigh((centred * area[:, None]).T @ centred)[1].T[::-1]

    def hulls(self, planes: Sequence[Plane]) -> np.ndarray:
        """(P,) volume of the hulls of the two sides of each plane together; infinite where one side has
        nothing."""
        rows = np.array([[*normal, offset] for normal, offset in planes]).reshape(-1, 4)
        return split_hull_volumes(self.vertices, self.faces, self.edges, rows, _SLACK * self.size)


def candidates(corners: Corners) -> list[Plane]:
    """Normal (3,) and offset of each plane that may cut well, the plainest first."""
    square = _across(corners, np.eye(3)) if np.abs(corners.axes).max(axis=1).min() < 0.999 else []
    return [*_along_concave_edges(corners, halving=True), *square, *_across(corners, corners.axes)]


def moved(corners: Corners, plane: Plane) -> Plane:
    """The plane, turned and moved by steps that halve to where the hulls of both sides are smallest; itself
    where it is best."""
    normal, offset = plane
    middle = corners.vertices.mean(axis=0)
    least = corners.hulls([plane])[0]
    for turn in _TURNS:
        across = np.linalg.svd(normal[None])[2][1:]
        place = offset - normal @ middle
        tried = [(normal, offset + way * _SHIFT * turn * corners.size) for way in (1, -1)]
        for way in (*across, *-across):
            turned = (normal + turn * way) / np.hypot(1, turn)
            tried.append((turned, float(turned @ middle + place)))
        left = corners.hulls(tried)
        at = int(np.argmin(left))
        if left[at] < (1 - _LESS) * least:
            (normal, offset), least = tried[at], left[at]
            plane = normal, offset
    return plane


def across_axes(corners: Corners) -> list[Plane]:
    """Nine planes across the principal axes: in the middle of each, then a quarter from either end."""
    return _across(corners, corners.axes)[:9]


def _across(corners: Corners, axes: np.ndarray) -> list[Plane]:
    along = corners.vertices @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    return [
        (axes[i], float(low[i] + share * (high[i] - low[i])))
        for share in _SHARES
        for i in range(3)
        if high[i] > low[i]
    ]


def beside_concave_edges(corners: Corners) -> list[Plane]:
    """The planes of faces beside concave edges, those with the longest edges first."""
    return _along_concave_edges(corners, halving=False)


def _along_concave_edges(corners: Corners, *, halving: bool) -> list[Plane]:
    """The planes of the faces beside concave edges, and those that halve the angle between them; of planes
    that are nearly the same the one with the longest edges."""
    vertices, normals = corners.vertices, corners.normals
    first, second = normals[corners.beside.T]
    start, stop = vertices[corners.edges.T]
    along = stop - start
    turn = np.einsum("ij,ij->i", np.cross(first, second), along)
    length = np.linalg.norm(along, axis=1)
    sine = np.divide(turn, length, out=np.zeros_like(turn), where=length > 0)
    concave = sine < -_CONCAVE
    if not concave.any():
        return []
    first, second, start, length = first[concave], second[concave], start[concave], length[concave]
    between = first - second
    kinds = 3 if halving else 2
    rows = np.concatenate([first, second, between][:kinds])
    weight = np.tile(length * -sine[concave], kinds)
    weight[2 * len(first) :] *= _HALVING
    norm = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = np.divide(rows, norm, out=np.zeros_like(rows), where=norm > 0)
    offsets = np.einsum("ij,ij->i", rows, np.tile(start, (kinds, 1)))
    real = norm[:, 0] > 0
    rows, offsets, weight = rows[real], offsets[real], weight[real]
    leading = rows[np.arange(len(rows)), np.abs(rows).argmax(axis=1)]
    sign = np.sign(leading)
    rows, offsets = rows * sign[:, None], offsets * sign
    keys = np.column_stack([np.round(rows / _SAME[0]), np.round(offsets / (_SAME[1] * corners.size))])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    total = np.bincount(group, weight)
    order = np.lexsort((-weight, group))
    longest = order[np.unique(group[order], return_index=True)[1]]
    chosen = np.argsort(-total, kind="stable")[:_MOST]
    return [(rows[longest[i]], float(offsets[longest[i]])) for i in chosen]
