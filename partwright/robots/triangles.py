"""Triangles cut by planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_DIRECTIONS = np.array([way for way in np.ndindex(5, 5, 5) if way != (2, 2, 2)], float) - 2


def clipped(triangles: np.ndarray, normals: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """(N, 3, 3) what of triangles (T, 3, 3) is behind all planes: normals (F, 3), offsets (F,)."""
    crossed = (triangles @ normals.T > offsets).any(axis=(0, 1))
    for normal, offset in zip(normals[crossed], offsets[crossed], strict=True):
        triangles = side_of(triangles, normal, offset)
    return triangles


def side_of(triangles: np.ndarray, normal: np.ndarray, offset: float) -> np.ndarray:
    """(N, 3, 3) what of triangles (T, 3, 3) is behind a plane, in triangles; what only touches it is not."""
    depth = triangles @ normal - offset
    behind = depth <= 0
    count = behind.sum(axis=1)
    crossing = (count == 1) | (count == 2)
    if not crossing.any():
        return triangles[count == 3]
    lone = np.where(count[crossing] == 1, behind[crossing].argmax(axis=1), behind[crossing].argmin(axis=1))
    rows = np.arange(len(lone))
    (a, b, c), (da, db, dc) = (
        [array[crossing][rows, (lone + k) % 3] for k in range(3)] for array in (triangles, depth)
    )
    ab, ac = (a + (da / (da - other))[:, None] * (end - a) for end, other in ((b, db), (c, dc)))
    one = count[crossing] == 1
    return np.concatenate(
        [
            triangles[count == 3],
            np.stack([a, ab, ac], axis=1)[one],
            np.stack([ab, b, c], axis=1)[~one],
            np.stack([ab, c, ac], axis=1)[~one],
        ]
    )


@dataclass(frozen=True)
class Halves:
    """Triangles that a plane may cut in two. vertices: (V, 3), each once; edges: (E, 2); reach: (V, D) how
    far each vertex is in some directions."""

    vertices: np.ndarray
    edges: np.ndarray
    reach: np.ndarray

    @classmethod
    def of(cls, triangles: np.ndarray) -> Halves:
        """triangles: (T, 3, 3)."""
        vertices, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        corners = index.reshape(-1, 3)
        edges = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        return cls(vertices, np.unique(edges, axis=0), vertices @ _DIRECTIONS.T)

    def points(self, normal: np.ndarray, offset: float) -> list[np.ndarray]:
        """(N, 3) corners of what is behind a plane, and of what is before it; none where it cuts nothing."""
        depth = self.vertices @ normal - offset
        crossing = self._crossing(depth)
        sides = [depth <= 0, depth > 0]
        return [np.concatenate([self.vertices[side], crossing]) for side in sides] if len(crossing) else []

    def ends(self, normal: np.ndarray, offset: float) -> list[np.ndarray]:
        """Of `points`, about those that are farthest in some directions."""
        depth = self.vertices @ normal - offset
        crossing = self._crossing(depth)
        if not len(crossing):
            return []
        found = []
        for side in (depth <= 0, depth > 0):
            index = np.flatnonzero(side)
            farthest = np.unique(self.reach[index].argmax(axis=0))
            found.append(np.concatenate([self.vertices[index[farthest]], crossing]))
        return found

    def _crossing(self, depth: np.ndarray) -> np.ndarray:
        """(N, 3) where edges cross the plane from which vertices are so far (V,)."""
        start, stop = self.edges[(depth[self.edges[:, 0]] <= 0) != (depth[self.edges[:, 1]] <= 0)].T
        share = depth[start] / (depth[start] - depth[stop])
        return self.vertices[start] + share[:, None] * (self.vertices[stop] - self.vertices[start])
