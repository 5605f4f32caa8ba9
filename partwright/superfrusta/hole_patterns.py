"""Holes of one form that a shape has many of, as a vented wall or a ring of bolt holes.

Each may hold too little for a part of its own, and together they hide the wall that they go through: so they
are found before any part is, in the shape itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from partwright.shapes import Shape
from partwright.shapes.grid import DistanceGrid, grid_indices
from partwright.superfrusta.samples import FitSamples, voxel_of
from partwright.superfrusta.symmetry import Isometry, image_error, refined, shifted

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FEWEST, _MOST = 4, 400  # holes
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
_SAME = 0.5  # of a hole that lies in another: both are one
_TOLERANCE = 2.5e-3  # unit lengths: by so much more a hole's wall may be off, on average, when it is moved
_UNTURNED = 1e-3  # unit lengths: by so much more a hole may be off that is moved without being turned
_NEIGHBOURS, _STEPS = 4, 8  # of each hole; and between them, in which a pattern is gone on with
_ONE_PLACE = 0.02  # unit lengths between middles: no step is tried twice
_APART = 0.7  # of a hole's narrower extent, between the middles of two
_WALL_POINTS = 400
_FINE = 32  # cells along the longest side of a lattice about a hole

_STILL = Isometry(np.eye(3), np.zeros(3))
_FLIPS = [np.diag([x, y, x * y]) for x, y in product((1.0, -1.0), repeat=2)]


@dataclass(frozen=True)
class HolePattern:
    """Holes of one form.

    hole: voxels (X * Y * Z,) of one of them. frame: (3, 3), its axes in columns, the last along it.
    isometries: from it to the others. filling: voxels (X, Y, Z) of all.
    """

    hole: Mask
    frame: Floats
    isometries: tuple[Isometry, ...]
    filling: Mask


@dataclass(frozen=True)
class _Hole:
    """voxels: flat indices into the grid. middle: (3,). frame: as a pattern's. extents: (3,) along it."""

    voxels: NDArray[np.int64]
    middle: Floats
    frame: Floats
    extents: Floats

    @property
    def width(self) -> float:
        return float(self.extents[:2].min())

    def meets(self, other: _Hole) -> bool:
        apart = float(np.linalg.norm(self.middle - other.middle))
        return apart < _APART * min(self.width, other.width)

    def mask(self, size: int) -> Mask:
        result = np.zeros(size, bool)
        result[self.voxels] = True
        return result

    def like(self, other: _Hole, spacing: float) -> bool:
        slack = np.array([_ALIKE, _ALIKE, _DEEPER])
        low, high = np.minimum(self.extents, other.extents), np.maximum(self.extents, other.extents)
        return bool((high <= slack * low + _ALIKE_VOXELS * spacing).all())


def hole_patterns(shape: Shape, samples: FitSamples) -> list[HolePattern]:
    """Those of at least four holes, those that hold the most first; none of their holes is in two.

    A hole is what a layer across one of the shape's walls goes all around, in layer upon layer.
    """
    normals = shape.unit_surface(_NORMALS, samples.seed).normals.astype(np.float64)
    found: list[_Hole] = []
    for direction in directions(normals):
        # Of one that is found across several walls, the first.
        found += [one for one in _holes(samples, direction) if not any(one.meets(other) for other in found)]
        found = found[:_MOST]
    return sorted(_patterns(samples, found), key=lambda pattern: -np.count_nonzero(pattern.filling))


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


def _holes(samples: FitSamples, along: Floats) -> Iterator[_Hole]:
    """Empty voxels that the shape goes all around in layers across a direction, where they are narrow."""
    spacing = samples.grid.spacing
    axes = _across(along)
    seen = samples.surface.astype(np.float64) @ axes
    low = seen.min(axis=0) - _ROOM * spacing
    counts = np.ceil((seen.max(axis=0) + _ROOM * spacing - low) / spacing).astype(int) + 1
    places = (low + spacing * grid_indices(tuple(counts))) @ axes.T
    occupied = (samples.near_distance(places.astype(np.float32)) < 0).reshape(counts)
    layer = ndimage.generate_binary_structure(3, 1)
    layer[:, :, [0, 2]] = False
    labels, count = ndimage.label(~occupied, layer)
    section = np.bincount(labels.ravel(), minlength=count + 1) * spacing**2
    narrow = section < _WIDEST
    narrow[0] = False  # the shape itself
    for axis, side in product((0, 1), (0, -1)):
        narrow[np.take(labels, side, axis=axis)] = False
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


def _hole(samples: FitSamples, points: Floats, axes: Floats, within: Callable[[Floats], Mask]) -> _Hole:
    middle = points.mean(axis=0)
    local = (points - middle) @ axes
    _, turn = np.linalg.eigh(np.cov(local[:, :2].T) + np.diag([1e-9, 0]))
    frame = axes.copy()
    frame[:, :2] = axes[:, :2] @ turn
    frame[:, 0] *= np.sign(np.linalg.det(frame))
    spread = ((points - middle) @ frame).var(axis=0) + samples.grid.spacing**2 / 12
    return _Hole(_voxels(samples.grid, points, within), middle, frame, np.sqrt(12 * spread))


def _voxels(grid: DistanceGrid, points: Floats, within: Callable[[Floats], Mask]) -> NDArray[np.int64]:
    """Flat indices of the empty voxels about points (N, 3) whose middles are within something."""
    low, high = ((end - grid.origin) / grid.spacing for end in (points.min(axis=0), points.max(axis=0)))
    first = np.maximum(np.floor(low).astype(np.int64) - 1, 0)
    last = np.minimum(np.ceil(high).astype(np.int64) + 2, grid.values.shape)
    index = first + grid_indices(tuple(np.maximum(last - first, 0)))
    index = index[within(grid.origin + grid.spacing * index)]
    flat = np.ravel_multi_index(tuple(index.T), grid.values.shape)
    return flat[grid.values.ravel()[flat] > 0]


def _across(along: Floats) -> Floats:
    """(3, 3) orthonormal columns, the last of them the direction; the world's axes where it is one."""
    first = np.eye(3)[np.abs(along).argmin()]
    first -= along * (first @ along)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along, first), along], axis=1)


def _patterns(samples: FitSamples, holes: Sequence[_Hole]) -> Iterator[HolePattern]:
    """Of holes that are alike in their extents, those that one takes to, as their walls say."""
    left = list(holes)
    while len(left) >= _FEWEST:
        alike = [one for one in left if one.like(left[0], samples.grid.spacing)]
        first = sorted(alike, key=lambda hole: len(hole.voxels))[len(alike) // 2]
        left = [one for one in left if one is not first]
        if len(alike) < _FEWEST:
            continue
        form = _Form(samples, first)
        ways = form.completed(
            [way for one in alike if one is not first and (way := form.way(one)) is not None]
        )
        if len(ways) + 1 >= _FEWEST:
            filling = form.filling(ways)
            shape = samples.grid.values.shape
            yield HolePattern(first.mask(filling.size), first.frame, tuple(ways), filling.reshape(shape))
            left = [
                one for one in left if filling[one.voxels].mean() < _SAME and form.clear(one.middle, ways)
            ]


@dataclass(frozen=True)
class _Form:
    """A hole, beside those that may be of its form."""

    samples: FitSamples
    hole: _Hole

    def way(self, other: _Hole) -> Isometry | None:
        """The isometry to another hole that brings the wall nearest to the shape's surface; None where none
        does. One that turns nothing is preferred."""
        first = self.hole
        best, least = None, self.most
        for turn in (np.eye(3), *(other.frame @ flip @ first.frame.T for flip in _FLIPS)):
            way, error = self.laid(Isometry(turn, other.middle - turn @ first.middle))
            if error < least - (_UNTURNED if best is not None else 0.0):
                best, least = way, error
            if least < self.most - _TOLERANCE + _UNTURNED:
                break
        return best

    def laid(self, isometry: Isometry) -> tuple[Isometry, float]:
        """An isometry after a small motion, and how far the wall is from the shape's surface then. One that
        turns nothing stays one."""
        way = refined(self.samples.grid, isometry, self.wall, shifted)
        if np.allclose(isometry.linear, np.eye(3)):
            way = Isometry(np.eye(3), self.place(way) - self.hole.middle)
        return way, image_error(self.samples.grid, way, self.wall)

    def completed(self, ways: Sequence[Isometry]) -> list[Isometry]:
        """The isometries, and those that go on in their steps for as long as there are such holes: where a
        web is thinner than a voxel, two holes look like one."""
        known = [_STILL, *ways]
        tried = [self.place(way) for way in known]
        away, near = cKDTree(tried).query(tried, min(_NEIGHBOURS + 1, len(known)))
        pairs = [divmod(i, away.shape[1]) for i in np.argsort(away, axis=None, kind="stable")]
        closest = [(a, near[a, k]) for a, k in pairs if near[a, k] != a][:_STEPS]
        steps = [known[b] @ known[a].inverse() for a, b in closest]
        for way in known:  # grows on the way
            for step in steps:
                place = self.place(step @ way)
                if np.linalg.norm(np.array(tried) - place, axis=1).min() < _ONE_PLACE:
                    continue
                tried.append(place)
                found, error = self.laid(step @ way)
                if error < self.most and self.clear(self.place(found), known):
                    known.append(found)
        return known[1:]

    def clear(self, place: Floats, ways: Sequence[Isometry]) -> bool:
        """Whether a place (3,) is in neither the hole nor its images."""
        taken = np.array([self.place(way) for way in (_STILL, *ways)])
        return bool(np.linalg.norm(taken - place, axis=1).min() > _APART * self.hole.width)

    def place(self, way: Isometry) -> Floats:
        """(3,) where the hole's middle comes to."""
        return np.asarray(way(self.hole.middle[None])[0])

    def filling(self, ways: Sequence[Isometry]) -> Mask:
        """Voxels (X * Y * Z,) of the hole and of its images."""
        grid = self.samples.grid
        hole = self.hole.mask(grid.values.size)
        points, mask = grid.points()[self.hole.voxels], hole.copy()

        def image(way: Isometry) -> Callable[[Floats], Mask]:
            back = way.inverse()
            return lambda at: np.asarray(hole[voxel_of(grid, back(at).astype(np.float32))])

        for way in ways:
            mask[_voxels(grid, way(points), image(way))] = True
        return mask

    @cached_property
    def most(self) -> float:
        """How far off, on average, the wall may be."""
        return image_error(self.samples.grid, _STILL, self.wall) + _TOLERANCE

    @cached_property
    def wall(self) -> Floats:
        """Points (N, 3) of the shape's surface around the hole."""
        return _wall(self.samples, self.hole)


def _wall(samples: FitSamples, hole: _Hole) -> Floats:
    """Points (N, 3) of the shape's surface around a hole."""
    grid = samples.grid
    corners = grid.points()[hole.voxels]
    low, high = corners.min(axis=0) - 2 * grid.spacing, corners.max(axis=0) + 2 * grid.spacing
    cell = float((high - low).max()) / _FINE
    counts = np.ceil((high - low) / cell).astype(int) + 1
    places = low + cell * grid_indices(tuple(counts))
    distance = samples.near_distance(places.astype(np.float32)).astype(np.float64).reshape(counts)
    slope = np.stack([one.ravel() for one in np.gradient(distance, cell)], axis=1)
    near = np.flatnonzero((np.abs(distance.ravel()) < cell) & (np.linalg.norm(slope, axis=1) > 0.5))
    points = places[near] - (distance.ravel()[near] / (slope[near] ** 2).sum(axis=1))[:, None] * slope[near]
    around = np.zeros(grid.values.shape, bool)
    around.ravel()[hole.voxels] = True
    around = ndimage.binary_dilation(around, np.ones((3, 3, 3)))
    points = points[around.ravel()[voxel_of(grid, points)]]
    return points[:: max(1, len(points) // _WALL_POINTS)]
