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
    lower, size = joint_box(first, second)
    return owners_in(first, lower, size, resolution), owners_in(second, lower, size, resolution)


def joint_box(first: PartedSurface, second: PartedSurface) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower corner (3,) and sides (3,) of the box around both."""
    corners = [np.asarray(s.vertices, dtype=np.float64)[np.unique(s.faces)] for s in (first, second)]
    both = np.concatenate(corners)
    return both.min(axis=0), np.maximum(np.ptp(both, axis=0), np.finfo(np.float32).eps)


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


def undecided(
    surface: PartedSurface, owner: NDArray[np.int64], lower: NDArray[np.float64], size: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(R, R, R): cells owned (R, R, R) by a part to which another part's surface is as near, to half a cell.

    Where parts meet in an edge that is bent inwards, a leg under a seat say, all that lies behind the edge
    (above the leg) is nearest to the edge itself, which is both parts'. Which of them owns it is chance.
    """
    vertices = np.asarray(surface.vertices, dtype=np.float64)
    faces, label = np.asarray(surface.faces, dtype=np.int64), np.asarray(surface.label, dtype=np.int64)
    tied = np.zeros(owner.shape, dtype=bool)
    resolution, tolerance = owner.shape[0], 0.5 * float(size.max()) / owner.shape[0]
    for part in np.setdiff1d(np.unique(owner), [OUTSIDE]):
        mine = owner == part
        places = lower + (np.argwhere(mine) + 0.5) * (size / resolution)
        own, others = faces[label == part], faces[label != part]
        if len(others):
            near, far = (MeshDistance(vertices, f, f, closed=False).unsigned(places) for f in (own, others))
            tied[mine] = far - near <= tolerance
    return tied


def whole_iou(first: NDArray[np.int64], second: NDArray[np.int64]) -> float:
    """`iou` of PartSDF's tables: of the wholes, over the joint bounding box."""
    return occupancy_iou(first != OUTSIDE, second != OUTSIDE)


def part_iou(first: NDArray[np.int64], second: NDArray[np.int64]) -> float:
    """`part_iou`: mean IoU of the parts that own a cell in either; 1 where both are empty."""
    parts = np.setdiff1d(np.union1d(first, second), [OUTSIDE])
    return float(np.mean([occupancy_iou(first == p, second == p) for p in parts])) if len(parts) else 1.0
