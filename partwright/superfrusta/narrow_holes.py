"""Holes of a shape: what it goes all around, in layer upon layer across one of its flat walls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.shapes import Shape
from partwright.shapes.grid import DistanceGrid, grid_indices
from partwright.superfrusta.hollows import closed_sections
from partwright.superfrusta.samples import FitSamples

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_MOST = 400  # holes that are looked at
_DIRECTIONS = 6  # at most, in which holes are looked for: across the walls that there is the most of
_WALL = 0.04  # of the surface that faces one way, for holes to be looked for across it
_FACING = np.cos(np.radians(3))
_COMPARED = 300  # points of the surface that propose a direction
_NORMALS = 8000
_ROOM = 1.5  # voxels around the shape
_WIDEST = 0.3  # unit lengths squared: section of a hole
_LARGEST = 0.05  # of the shape's volume
_LEAST = 8  # voxels
_EVEN = 0.75  # of a hole's largest section, that its mean is at least
_ALIKE, _ALIKE_VOXELS = 1.2, 1.0  # times, and voxels, that extents of holes of one form may differ
_DEEPER = 1.4  # times that depths may
APART = 0.7
"""Of a hole's narrower extent: middles of two holes that are nearer are of one."""


@dataclass(frozen=True)
class Hole:
    """voxels: flat indices into the grid. middle: (3,). frame: (3, 3), axes in columns, the last along it.
    extents: (3,) along them."""

    voxels: NDArray[np.int64]
    middle: Floats
    frame: Floats
    extents: Floats

    @property
    def width(self) -> float:
        return float(self.extents[:2].min())

    def meets(self, other: Hole) -> bool:
        apart = float(np.linalg.norm(self.middle - other.middle))
        return apart < APART * min(self.width, other.width)

    def mask(self, size: int) -> Mask:
        result = np.zeros(size, bool)
        result[self.voxels] = True
        return result

    def like(self, other: Hole, spacing: float) -> bool:
        slack = np.array([_ALIKE, _ALIKE, _DEEPER])
        low, high = np.minimum(self.extents, other.extents), np.maximum(self.extents, other.extents)
        return bool((high <= slack * low + _ALIKE_VOXELS * spacing).all())


def narrow_holes(shape: Shape, samples: FitSamples) -> list[Hole]:
    """Those across the walls that there is the most of; one that is found across several comes once."""
    normals = shape.unit_surface(_NORMALS, samples.seed).normals.astype(np.float64)
    found: list[Hole] = []
    for direction in directions(normals):
        for one in _across(samples, direction):
            if len(found) == _MOST:
                return found
            if not any(one.meets(other) for other in found):
                found.append(one)
    return found


def directions(normals: Floats) -> list[Floats]:
    """Unit vectors (3,) that much of a surface faces, or faces away from, by its normals (N, 3)."""
    found: list[Floats] = []
    left = normals
    while len(left) and len(found) < _DIRECTIONS:
        proposed = left[:: max(1, len(left) // _COMPARED)]
        facing = np.abs(proposed @ left.T) > _FACING
        most = int(facing.sum(axis=1).argmax())
        mine = facing[most]
        if np.count_nonzero(mine) < _WALL * len(normals):
            break
        mean = (left[mine] * np.sign(left[mine] @ proposed[most])[:, None]).mean(axis=0)
        found.append(mean / np.linalg.norm(mean))
        left = left[~mine]
    return found


def _across(samples: FitSamples, along: Floats) -> Iterator[Hole]:
    """Empty voxels that the shape goes all around in layers across a direction, where they are narrow."""
    spacing = samples.grid.spacing
    axes = _axes(along)
    seen = samples.surface.astype(np.float64) @ axes
    low = seen.min(axis=0) - _ROOM * spacing
    counts = np.ceil((seen.max(axis=0) + _ROOM * spacing - low) / spacing).astype(int) + 1
    places = (low + spacing * grid_indices(tuple(counts))) @ axes.T
    occupied = (samples.near_distance(places.astype(np.float32)) < 0).reshape(counts)
    labels, closed = closed_sections(occupied, 2)
    narrow = closed & (np.bincount(labels.ravel(), minlength=len(closed)) * spacing**2 < _WIDEST)
    pieces, _ = ndimage.label(narrow[labels])
    most = _LARGEST * np.count_nonzero(occupied)
    for number, box in enumerate(ndimage.find_objects(pieces), 1):
        cells = np.argwhere(pieces[box] == number)
        sections = np.bincount(cells[:, 2])
        if _LEAST <= len(cells) <= most and sections.mean() > _EVEN * sections.max():
            cells += [one.start for one in box]

            def within(points: Floats, number: int = number) -> Mask:
                cell = np.rint((points @ axes - low) / spacing).astype(np.int64)
                there = ((cell >= 0) & (cell < counts)).all(axis=1)
                there[there] = pieces[tuple(cell[there].T)] == number
                return there

            hole = _hole(samples, (low + spacing * cells) @ axes.T, axes, within)
            if len(hole.voxels):
                yield hole


def _hole(samples: FitSamples, points: Floats, axes: Floats, within: Callable[[Floats], Mask]) -> Hole:
    middle = points.mean(axis=0)
    local = (points - middle) @ axes
    _, turn = np.linalg.eigh(np.cov(local[:, :2].T) + np.diag([1e-9, 0]))
    frame = axes.copy()
    frame[:, :2] = axes[:, :2] @ turn
    frame[:, 0] *= np.sign(np.linalg.det(frame))
    spread = ((points - middle) @ frame).var(axis=0) + samples.grid.spacing**2 / 12
    return Hole(voxels_within(samples.grid, points, within), middle, frame, np.sqrt(12 * spread))


def voxels_within(grid: DistanceGrid, points: Floats, within: Callable[[Floats], Mask]) -> NDArray[np.int64]:
    """Flat indices of the empty voxels about points (N, 3) whose middles are within something."""
    low, high = ((end - grid.origin) / grid.spacing for end in (points.min(axis=0), points.max(axis=0)))
    first = np.maximum(np.floor(low).astype(np.int64) - 1, 0)
    last = np.minimum(np.ceil(high).astype(np.int64) + 2, grid.values.shape)
    index = first + grid_indices(tuple(np.maximum(last - first, 0)))
    index = index[within(grid.origin + grid.spacing * index)]
    flat = np.ravel_multi_index(tuple(index.T), grid.values.shape)
    return flat[grid.values.ravel()[flat] > 0]


def _axes(along: Floats) -> Floats:
    """(3, 3) orthonormal columns, the last of them the direction; the world's axes where it is one."""
    first = np.eye(3)[np.abs(along).argmin()]
    first -= along * (first @ along)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along, first), along], axis=1)
