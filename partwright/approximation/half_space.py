"""How much of a closed solid lies beyond a plane, for many parallel planes, without cutting it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright import _kernel
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
        areas = area_vectors(vertices[faces]) / 2
        return cls(np.ascontiguousarray(vertices), np.ascontiguousarray(faces), np.ascontiguousarray(areas))

    def beyond(self, normal: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """(K,) volume where normal . p > offset, for each of the offsets (K,).

        Every triangle is the top or the bottom of a prism that ends on the plane: what counts is its area
        along the normal (3,), signed, and the mean height of it beyond the plane.
        """
        normal = np.ascontiguousarray(normal, dtype=np.float64)
        offsets = np.ascontiguousarray(offsets, dtype=np.float64)
        return _kernel.volumes_beyond(self.vertices, self.faces, self.areas, normal, offsets)
