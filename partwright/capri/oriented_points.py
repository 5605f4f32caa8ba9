"""Points of a shape's surface with the normals of the smooth surface behind its triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes import Shape
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.topology import area_vectors

_MIN_SMOOTH_COSINE = np.cos(np.radians(32.0))  # facets that meet at less belong to one curved surface


@dataclass(frozen=True)
class OrientedPoints:
    """Area-weighted points (N, 3), outward unit normals (N, 3), unit frame; `area` of the whole surface."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    area: float

    @property
    def spacing(self) -> float:
        """Side of the square that a point stands for."""
        return float(np.sqrt(self.area / len(self.points)))


def sample_surface(shape: Shape, count: int, seed: int) -> OrientedPoints:
    """`count` points of the shape's surface in the unit frame.

    A tessellated cylinder's triangles have normals up to half a facet off; where facets meet smoothly, the
    normals are interpolated between those of the corners.
    """
    vertices, faces = shape.frame.to_unit(shape.vertices), shape.faces
    points, face = sample_triangles(vertices, faces, count, seed)
    corners = vertices[faces]
    cross = area_vectors(corners)
    smooth = _corner_normals(faces, cross, _angles(corners), len(vertices))
    weights = _barycentric(corners[face], points)
    normals = (weights[:, :, None] * smooth[face]).sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return OrientedPoints(points, normals, float(np.linalg.norm(cross, axis=1).sum() / 2))


def _corner_normals(
    faces: NDArray[np.int64], cross: NDArray[np.float64], angles: NDArray[np.float64], vertices: int
) -> NDArray[np.float64]:
    """(F, 3, 3) normal at each corner: the faces around the vertex that meet this one smoothly, by angle."""
    length = np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    unit = cross / length
    corner = faces.ravel()
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner, minlength=vertices)
    first = np.cumsum(count) - count
    repeat = count[corner]
    owner = np.repeat(np.arange(len(corner)), repeat)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(repeat) - repeat, repeat)
    around = order[first[corner[owner]] + within]
    other, weight = around // 3, angles.ravel()[around]
    alike = (unit[owner // 3] * unit[other]).sum(axis=1) > _MIN_SMOOTH_COSINE
    total = np.zeros((len(corner), 3))
    for k in range(3):
        total[:, k] = np.bincount(owner[alike], (weight * unit[other, k])[alike], len(corner))
    total = np.where(np.linalg.norm(total, axis=1, keepdims=True) > 1e-9, total, np.repeat(unit, 3, axis=0))
    length = np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)  # of slivers, 0
    return np.asarray((total / length).reshape(-1, 3, 3))


def _angles(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle (F, 3) at each corner of triangles (F, 3, 3)."""
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(ahead, back), axis=2), (ahead * back).sum(axis=2)))


def _barycentric(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights (N, 3) of points that lie in triangles (N, 3, 3)."""
    u, v, w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    normal = np.cross(u, v)
    square = np.maximum((normal * normal).sum(axis=1), 1e-300)
    second = (np.cross(w, v) * normal).sum(axis=1) / square
    third = (np.cross(u, w) * normal).sum(axis=1) / square
    return np.clip(np.stack([1 - second - third, second, third], axis=1), 0.0, 1.0)
