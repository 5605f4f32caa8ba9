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
from partwright.shapes.grid import grid_indices
from partwright.superfrusta.narrow_holes import APART, Hole, narrow_holes, voxels_within
from partwright.superfrusta.samples import FitSamples, voxel_of
from partwright.superfrusta.symmetry import Isometry, image_error, refined, shifted

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FEWEST = 4  # holes
_SAME = 0.5  # of a hole that lies in another: both are one
_TOLERANCE = 2.5e-3  # unit lengths: by so much more a hole's wall may be off, on average, when it is moved
_UNTURNED = 1e-3  # unit lengths: by so much more a hole may be off that is moved without being turned
_IN_VAIN = 12  # holes of another form, after which no more are compared with one
_FAILURES = 8  # holes that no others are like, after which no pattern is looked for
_NEIGHBOURS, _STEPS = 4, 8  # of each hole; and between them, in which a pattern is gone on with
_ONE_PLACE = 0.02  # unit lengths between middles: no step is tried twice
_WALL_POINTS = 400
_FINE = 32  # cells along the longest side of a lattice about a hole

_STILL = Isometry(np.eye(3), np.zeros(3))
_FLIPS = [np.diag([x, y, x * y]) for x, y in product((1.0, -1.0), repeat=2)]


@dataclass(frozen=True)
class HolePattern:
    """Holes of one form.

    hole: voxels (X, Y, Z) of one of them. frame: (3, 3), its axes in columns, the last along it.
    isometries: from it to the others. filling: the voxels of all.
    """

    hole: Mask
    frame: Floats
    isometries: tuple[Isometry, ...]
    filling: Mask


def hole_patterns(shape: Shape, samples: FitSamples) -> list[HolePattern]:
    """Those of at least four holes, those that hold the most first; none of their holes is in two."""
    return sorted(
        _patterns(samples, narrow_holes(shape, samples)),
        key=lambda pattern: -np.count_nonzero(pattern.filling),
    )


def _patterns(samples: FitSamples, holes: Sequence[Hole]) -> Iterator[HolePattern]:
    """Of holes that are alike in their extents, those that one takes to, as their walls say."""
    left = list(holes)
    taken: list[Floats] = []  # middles of the holes of earlier patterns
    failed = 0
    while len(left) >= _FEWEST and failed < _FAILURES:
        alike = [one for one in left if one.like(left[0], samples.grid.spacing)]
        first = sorted(alike, key=lambda hole: len(hole.voxels))[len(alike) // 2]
        left = [one for one in left if one is not first]
        if len(alike) < _FEWEST:
            continue
        form = _Form(samples, first)
        ways = form.completed(form.ways([one for one in alike if one is not first]), taken)
        if len(ways) + 1 < _FEWEST:
            failed += 1
            continue
        filling = form.filling(ways)
        shape = samples.grid.values.shape
        hole = first.mask(filling.size).reshape(shape)
        yield HolePattern(hole, first.frame, tuple(ways), filling.reshape(shape))
        taken += form.places(ways)
        left = [one for one in left if filling[one.voxels].mean() < _SAME and form.clear(one.middle, taken)]


@dataclass(frozen=True)
class _Form:
    """A hole, beside those that may be of its form."""

    samples: FitSamples
    hole: Hole

    def ways(self, others: Sequence[Hole]) -> list[Isometry]:
        """Those to others of this form; none if the first that are tried are all of another."""
        found: list[Isometry] = []
        for tried, other in enumerate(others if len(self.wall) else ()):
            way = self.way(other)
            if way is not None:
                found.append(way)
            elif tried >= _IN_VAIN and not found:
                break
        return found

    def way(self, other: Hole) -> Isometry | None:
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

    def completed(self, ways: Sequence[Isometry], taken: Sequence[Floats]) -> list[Isometry]:
        """The isometries, and those that go on in their steps for as long as there are such holes: where a
        web is thinner than a voxel, two holes look like one. What is taken, middles (3,), stays so."""
        if not ways:
            return []
        known = [_STILL, *ways]
        tried = [self.place(way) for way in known]
        away, near = cKDTree(tried).query(tried, min(_NEIGHBOURS + 1, len(known)))
        pairs = [divmod(i, away.shape[1]) for i in np.argsort(away, axis=None, kind="stable")]
        steps: list[Isometry] = []
        for a, k in pairs:
            step = known[near[a, k]] @ known[a].inverse()
            places = [self.hole.middle, *(self.place(one) for one in steps)]
            if (
                len(steps) < _STEPS
                and np.linalg.norm(np.array(places) - self.place(step), axis=1).min() > _ONE_PLACE
            ):
                steps.append(step)
        for way in known:  # grows on the way
            for step in steps:
                place = self.place(step @ way)
                if np.linalg.norm(np.array(tried) - place, axis=1).min() < _ONE_PLACE:
                    continue
                tried.append(place)
                found, error = self.laid(step @ way)
                if error < self.most and self.clear(self.place(found), [*self.places(known[1:]), *taken]):
                    known.append(found)
        return known[1:]

    def clear(self, place: Floats, taken: Sequence[Floats]) -> bool:
        """Whether a hole of this form about a place (3,) is none about those that are taken."""
        return bool(np.linalg.norm(np.array(taken) - place, axis=1).min() > APART * self.hole.width)

    def places(self, ways: Sequence[Isometry]) -> list[Floats]:
        """Middles (3,) of the hole and of its images."""
        return [self.hole.middle, *(self.place(way) for way in ways)]

    def place(self, way: Isometry) -> Floats:
        """(3,) where the hole's middle comes to."""
        return np.asarray(way(self.hole.middle[None])[0])

    def filling(self, ways: Sequence[Isometry]) -> Mask:
        """Voxels (X * Y * Z,) of the hole and of its images."""
        grid = self.samples.grid
        hole = self.hole.mask(grid.values.size)
        points, mask = grid.points_of(self.hole.voxels), hole.copy()

        def image(way: Isometry) -> Callable[[Floats], Mask]:
            back = way.inverse()
            return lambda at: np.asarray(hole[voxel_of(grid, back(at).astype(np.float32))])

        for way in ways:
            mask[voxels_within(grid, way(points), image(way))] = True
        return mask

    @cached_property
    def most(self) -> float:
        """How far off, on average, the wall may be."""
        return image_error(self.samples.grid, _STILL, self.wall) + _TOLERANCE

    @cached_property
    def wall(self) -> Floats:
        """Points (N, 3) of the shape's surface around the hole."""
        return _wall(self.samples, self.hole)


def _wall(samples: FitSamples, hole: Hole) -> Floats:
    """Points (N, 3) of the shape's surface around a hole."""
    grid = samples.grid
    corners = grid.points_of(hole.voxels)
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
