"""Rays against triangles (Embree), and what every pixel of a view sees."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from partwright.render.camera import View
from partwright.rows import corners, units
from partwright.shapes.corner_normals import corner_normals, face_normals

_MISS = -1


class Scene:
    """A triangle mesh that rays can be cast at. vertices (V, 3), faces (F, 3)."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.vertices = np.asarray(vertices, dtype=np.float64)
        self.faces = np.asarray(faces, dtype=np.int64)
        self.lower, self.upper = corners(self.vertices)
        # Embree works in float32: bring the mesh to a size and place where that is enough.
        self._centre = (self.lower + self.upper) / 2
        self._scale = 2.0 / max(float((self.upper - self.lower).max()), np.finfo(float).tiny)
        self._embree = EmbreeScene()
        self._mesh = TriangleMesh(self._embree, self._local(self.vertices), self.faces.astype(np.int32))

    @cached_property
    def corner_normals(self) -> np.ndarray:
        """(F, 3, 3) float, for shading, which who only asks what is hidden does not need."""
        return corner_normals(self.vertices, self.faces)

    @cached_property
    def face_normals(self) -> np.ndarray:
        """(F, 3) float32."""
        flat = face_normals(self.vertices, self.faces)
        length = np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), np.finfo(float).tiny)
        return (flat / length).astype(np.float32)

    def _local(self, points: np.ndarray) -> np.ndarray:
        return ((points - self._centre) * self._scale).astype(np.float32)

    def first_hit(
        self, origins: np.ndarray, directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Per ray: the face met first (-1 where none), the distance (inf where none), and u, v (N, 2)."""
        directions = np.ascontiguousarray(directions, dtype=np.float32)
        hit = self._embree.run(self._local(origins), directions, output=1)
        distance = np.where(hit["primID"] != _MISS, hit["tfar"].astype(np.float64) / self._scale, np.inf)
        return hit["primID"], distance, np.stack([hit["u"], hit["v"]], axis=1)

    def occluded(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(N,) bool: whether anything lies on the ray."""
        directions = np.ascontiguousarray(directions, dtype=np.float32)
        return self._embree.run(self._local(origins), directions, query="OCCLUDED") != _MISS

    @property
    def size(self) -> float:
        """Longest side of the bounding box."""
        return 2.0 / self._scale


@dataclass(frozen=True)
class Hits:
    """What the pixels of a view see. pixel: (N,) numbers of the pixels that meet the surface; point, normal:
    (N, 3) shading normals turned to the viewer; round: (N, 3) the points on the smooth surface that the
    normals suggest, where light's rays start; face: (N,)."""

    pixel: np.ndarray
    point: np.ndarray
    round: np.ndarray
    normal: np.ndarray
    face: np.ndarray

    def at(self, chosen: np.ndarray) -> Hits:
        """Those of these numbers (K,), or flags (N,)."""
        return Hits(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def moved_to(self, pixel: np.ndarray) -> Hits:
        """Hits of rays of which ray i goes through `pixel[i]`."""
        return replace(self, pixel=pixel[self.pixel])

    def and_also(self, others: Hits) -> Hits:
        """These, and then the others."""
        pairs = ((getattr(self, field.name), getattr(others, field.name)) for field in fields(self))
        return Hits(*(np.concatenate(pair) for pair in pairs))


def cast(scene: Scene, view: View, rays: np.ndarray) -> Hits:
    """What the rays (N, 3) from the view's eye meet; they count as pixels 0 to N - 1."""
    face, distance, weights = scene.first_hit(np.broadcast_to(view.eye, rays.shape), rays)
    pixel = np.flatnonzero(face != _MISS)
    face, rays = face[pixel], rays[pixel]
    u, v = weights[pixel].T
    around = scene.corner_normals[face]
    normal = (1 - u - v)[:, None] * around[:, 0] + u[:, None] * around[:, 1] + v[:, None] * around[:, 2]
    normal = units(normal)
    # An open or inverted surface shows its back: shade that like a front.
    away = np.einsum("nd,nd->n", scene.face_normals[face], rays) > 0
    normal[away] *= -1
    point = view.eye + distance[pixel, None] * rays
    return Hits(pixel, point, _rounded(scene, point, face, np.stack([1 - u - v, u, v]), away), normal, face)


def _rounded(
    scene: Scene, point: np.ndarray, face: np.ndarray, weights: np.ndarray, away: np.ndarray
) -> np.ndarray:
    """(N, 3) points lifted from flat facets to the round surface that they stand for.

    Light from low over a facet is otherwise cut off by its neighbours, in stripes. Each point goes to the
    weighted mean of its projections on the planes of the corners' normals (Hanika, "Hacking the shadow
    terminator", Ray Tracing Gems II, ch. 4).
    """
    lifted = point.copy()
    side = np.where(away, -1.0, 1.0)[:, None]
    for i, weight in enumerate(weights):
        normal = side * scene.corner_normals[face, i]
        below = np.minimum(np.einsum("nd,nd->n", point - scene.vertices[scene.faces[face, i]], normal), 0.0)
        lifted -= (weight * below)[:, None] * normal
    return lifted
