"""A part of a solid that is to become its hull, and what hulls may do wrong."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.cutting_planes import Corners
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

MOST = 64  # pieces at most, where nobody asked for fewer
_SAMPLES = 0.5  # of the tolerance: spacing of points on a hull
_FEWEST, _DENSEST = 12.0, 60.0  # points along the longest side of a hull, whatever the tolerance


@dataclass(frozen=True)
class Limits:
    """deviation: how far a hull's surface may lie from the solid's, as a length. extra: volume that all hulls
    may add, over the solid's. most: pieces at most; this one is kept where not all can be. worth: of the mean
    of what hulls add, what one piece more has to save to be made though the limits ask for none, and beyond
    many pieces though they ask for more; None for none."""

    deviation: float
    extra: float = 0.03
    most: int = MOST
    worth: float | None = None


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of the solid, and the least convex solid around it."""

    solid: Manifold

    @cached_property
    def hull(self) -> Manifold:
        return hull_of(surface_of(self.solid)[0])

    @cached_property
    def hull_corners(self) -> np.ndarray:
        """(N, 3) of the hull."""
        return surface_of(self.hull)[0]

    @cached_property
    def box(self) -> np.ndarray:
        """(2, 3) lower and upper corner."""
        return np.reshape(self.solid.bounding_box(), (2, 3))

    @cached_property
    def extra(self) -> float:
        """Volume that the hull adds."""
        return max(self.hull.volume() - self.solid.volume(), 0.0)

    @cached_property
    def corners(self) -> Corners:
        return Corners.of(self.solid)

    def within(self, limit: float) -> bool:
        """Whether the hull's surface lies no farther than a length from the solid's, by points dense enough
        for it. Most hulls that are too far off are so in the middle of a face: these points come first."""
        vertices, faces = surface_of(self.solid)
        side = float(np.ptp(vertices, axis=0).max())
        middle, scale = vertices.mean(axis=0), 1.0 / side
        there = MeshDistance((vertices - middle) * scale, faces, faces, True)

        def near(points: np.ndarray) -> bool:
            return float(there.unsigned((points - middle) * scale).max(initial=0.0)) <= limit * scale

        corners, triangles = surface_of(self.hull)
        if not near(corners[triangles].mean(axis=1)):
            return False
        spacing = float(np.clip(_SAMPLES * limit, side / _DENSEST, side / _FEWEST))
        fine = self.hull.refine_to_length(spacing).to_mesh()
        return near(np.asarray(fine.vert_properties)[:, :3])
