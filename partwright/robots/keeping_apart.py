"""Enclosing hulls of two links held apart by planes, as far as what they contain lets them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from partwright.approximation.hull_faces import faces_of
from partwright.meshing.hulls import file_grid, file_hull, hull_of
from partwright.meshing.manifolds import as_mesh, surface_of
from partwright.robots.containment import shape_solid
from partwright.robots.enclosing import corners_beyond, within_one
from partwright.robots.model import Shape

_ROOM = 2  # steps of the grid that files' hulls are moved to: how far a plane stays off what is contained
_SHARE = 0.4  # of the gap between what two hulls contain: how far each reaches into it


@dataclass
class EnclosedLink:
    """A link's shapes, which contain its triangles (T, 3, 3), both in its frame. pose: (4, 4) of that."""

    shapes: Sequence[Shape]
    triangles: np.ndarray
    pose: np.ndarray

    def __post_init__(self) -> None:
        self.hulls = [shape_solid(shape) for shape in self.shapes]
        self.planes = [faces_of(hull) for hull in self.hulls]
        self.boxes = [np.reshape(hull.bounding_box(), (2, 3)) for hull in self.hulls]
        self.trimmed: set[int] = set()
        self.room = _ROOM * file_grid(self.triangles.reshape(-1, 3))

    def needed(self, index: int) -> np.ndarray:
        """(N, 3) points whose hull has all that only this shape contains of the triangles."""
        lower, upper = self.boxes[index]
        low, high = self.triangles.min(axis=1), self.triangles.max(axis=1)
        near = self.triangles[((low <= upper) & (high >= lower)).all(axis=1)]
        others = [i for i in range(len(self.planes)) if i != index]
        near = near[~within_one([self.planes[i] for i in others], [self.boxes[i] for i in others], near)]
        across = (corners_beyond(self.planes[index], near) > 0).any(axis=1)
        normals, offsets = self.planes[index]
        clipped = [_clipped(triangle, normals, offsets) for triangle in near[across]]
        return np.concatenate([near[~across].reshape(-1, 3), *clipped])

    def trim(self, index: int, normal: np.ndarray, offset: float) -> None:
        """Takes off a hull what is beyond a plane."""
        hull = self.hulls[index].trim_by_plane(tuple((-normal).tolist()), -offset)
        if not hull.is_empty() and hull.volume() < self.hulls[index].volume():
            self.hulls[index], self.planes[index] = hull, faces_of(hull)
            self.boxes[index] = np.reshape(hull.bounding_box(), (2, 3))
            self.trimmed.add(index)

    def result(self) -> list[Shape]:
        """The shapes as files have them."""
        return [
            dataclasses.replace(shape, mesh=as_mesh(file_hull(surface_of(hull)[0])))
            if i in self.trimmed
            else shape
            for i, (shape, hull) in enumerate(zip(self.shapes, self.hulls, strict=True))
        ]


def keep_apart(a: EnclosedLink, b: EnclosedLink) -> None:
    """Trims the hulls of two links where they overlap, by a plane each: between what they contain, where that
    leaves room for one, else as near to it as may be. Native solids stay."""
    between = np.linalg.inv(a.pose) @ b.pose  # from b's frame to a's
    turn, shift = between[:3, :3], between[:3, 3]
    for i in range(len(a.shapes)):
        for j in range(len(b.shapes)):
            if a.shapes[i].mesh is None or b.shapes[j].mesh is None:
                continue
            if (a.hulls[i] ^ b.hulls[j].transform(between[:3])).volume() <= 0:
                continue
            found = _plane_between(a.needed(i), b.needed(j) @ turn.T + shift)
            if found is None:
                continue
            normal, stop, start = found
            reach = _SHARE * (start - stop)
            a.trim(i, normal, stop + max(reach, a.room))
            b.trim(j, -normal @ turn, float(normal @ shift) - start + max(reach, b.room))


def _plane_between(ours: np.ndarray, theirs: np.ndarray) -> tuple[np.ndarray, float, float] | None:
    """Unit normal, and the offsets where the first points end along it and where the second begin: of the
    planes of both hulls' faces the one that leaves most between; None where either has no volume."""
    first, second = hull_of(ours), hull_of(theirs)
    if first.is_empty() or second.is_empty():
        return None
    normals = np.concatenate([faces_of(first)[0], -faces_of(second)[0]])
    stop = (surface_of(first)[0] @ normals.T).max(axis=0)
    start = (surface_of(second)[0] @ normals.T).min(axis=0)
    best = int((start - stop).argmax())
    return normals[best], float(stop[best]), float(start[best])


def _clipped(triangle: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """(N, 3) corners of what of a triangle (3, 3) is behind planes (F, 3), (F,); none where nothing is."""
    polygon = triangle
    crossed = (triangle @ normals.T > offsets).any(axis=0)  # others never are by what is left
    for normal, offset in zip(normals[crossed], offsets[crossed], strict=True):
        depth = polygon @ normal - offset
        corners = []
        for k in range(len(polygon)):
            here, before = depth[k], depth[k - 1]
            if (here > 0) != (before > 0):
                corners.append(polygon[k - 1] + before / (before - here) * (polygon[k] - polygon[k - 1]))
            if here <= 0:
                corners.append(polygon[k])
        if not corners:
            return np.empty((0, 3))
        polygon = np.array(corners)
    return polygon
