"""Occupancies of whole shapes and of their parts, which may be open (PartSDF, B.6)."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from partwright.metrics.iou import occupancy_iou
from partwright.shapes.distance import MeshDistance, grid_indices
from partwright.shapes.topology import EdgeTable

RESOLUTION = 128
OUTSIDE = -1


class PartedSurface(Protocol):
    """A surface whose triangles have a part each: vertices (V, 3), faces (F, 3), label (F,) from 0."""

    @property
    def vertices(self) -> NDArray[Any]: ...
    @property
    def faces(self) -> NDArray[Any]: ...
    @property
    def label(self) -> NDArray[Any]: ...


def joint_owners(
    first: PartedSurface, second: PartedSurface, resolution: int = RESOLUTION
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The part that owns each cell centre of the R^3 grid over the joint bounding box, or OUTSIDE.

    A point inside the whole belongs to the part whose surface is nearest, so parts need not be closed. Cells
    are as long as the box wants along each axis. Both (R, R, R).
    """
    corners = [np.asarray(s.vertices, dtype=np.float64)[np.unique(s.faces)] for s in (first, second)]
    both = np.concatenate(corners)
    lower, size = both.min(axis=0), np.maximum(np.ptp(both, axis=0), np.finfo(np.float32).eps)
    return owners_in(first, lower, size, resolution), owners_in(second, lower, size, resolution)


def owners_in(
    surface: PartedSurface, lower: NDArray[np.float64], size: NDArray[np.float64], resolution: int
) -> NDArray[np.int64]:
    """Owners (R, R, R) at the cell centres of the box from `lower` (3,) of that `size` (3,)."""
    vertices = np.asarray(surface.vertices, dtype=np.float64)
    faces = np.asarray(surface.faces, dtype=np.int64)
    closed = not EdgeTable(faces).balance.any()
    # Inside stays inside when the axes are stretched, so the box may become a cube with cubic cells.
    cube = MeshDistance((vertices - lower) / size, faces, faces, closed)
    inside = cube.inside_grid(
        np.full(3, 0.5 / resolution), 1 / resolution, (resolution, resolution, resolution)
    )
    owner = np.full(inside.shape, OUTSIDE)
    parts = np.unique(surface.label)
    if len(parts) == 1:
        owner[inside] = parts[0]
        return owner
    places = lower + (grid_indices(inside.shape)[inside.ravel()] + 0.5) * (size / resolution)
    nearest, _ = MeshDistance(vertices, faces, faces, closed).nearest(places)
    owner[inside] = np.asarray(surface.label, dtype=np.int64)[nearest]
    return owner


def whole_iou(first: NDArray[np.int64], second: NDArray[np.int64]) -> float:
    """`iou` of PartSDF's tables: of the wholes, over the joint bounding box."""
    return occupancy_iou(first != OUTSIDE, second != OUTSIDE)


def part_iou(first: NDArray[np.int64], second: NDArray[np.int64]) -> float:
    """`part_iou`: mean IoU of the parts that own a cell in either; 1 where both are empty."""
    parts = np.setdiff1d(np.union1d(first, second), [OUTSIDE])
    return float(np.mean([occupancy_iou(first == p, second == p) for p in parts])) if len(parts) else 1.0
