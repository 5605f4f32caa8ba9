"""How much of a closed solid lies beyond a plane, for many parallel planes, without cutting it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.manifolds import surface_of
from partwright.shapes.topology import area_vectors

if TYPE_CHECKING:
    from manifold3d import Manifold


@dataclass(frozen=True)
class Surface:
    """vertices: (V, 3). faces: (F, 3), counter-clockwise from outside. areas: (F, 3) along each axis."""

    vertices: np.ndarray
    faces: np.ndarray
    areas: np.ndarray

    @classmethod
    def of(cls, solid: Manifold) -> Surface:
        vertices, faces = surface_of(solid)
        return cls(vertices, faces, area_vectors(vertices[faces]) / 2)

    def beyond(self, normal: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """(K,) volume where normal . p > offset, for each of the offsets (K,).

        Every triangle is the top or the bottom of a prism that ends on the plane: what counts is its area
        along the normal (3,), signed, and the mean height of it beyond the plane.
        """
        height = (self.vertices @ normal)[self.faces]
        reaching = height.max(axis=1) > offsets.min()
        low, middle, high = np.sort(height[reaching], axis=1).T[:, :, None]
        below, above = offsets - low, high - offsets  # (F, K)
        with np.errstate(divide="ignore", invalid="ignore"):
            under = below**3 / (3 * (middle - low) * (high - low))
            tip = above**3 / (3 * (high - low) * (high - middle))
        mean = (low + middle + high) / 3 - offsets
        mean = np.where(below > 0, np.where(offsets < middle, mean + under, tip), mean)
        return np.asarray((self.areas[reaching] @ normal) @ np.where(above > 0, mean, 0.0))
