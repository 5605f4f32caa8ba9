"""How far each part of an assembly sticks out of the shape, and how far it leaves the surface uncovered.

An overlap hardly feels either: a tab as thin as a sheet holds no volume, and is what is seen first.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.at_once import at_once
from partwright.fields.columns import Column
from partwright.superfrusta.far_cells import CELL, middles_within
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.samples import FitSamples, Rows

Floats = NDArray[np.float32]

ON = 0.004  # unit lengths: points this near to a surface are on it
CLOSE = 0.009  # unit lengths, half a hundredth of the longest side: what is nearer is not off
_BESIDE = 0.005  # unit lengths from a surface at which a gap is looked for
_MOST_FAR = 60_000  # cells at most that are looked at
_DEEP, _SLIVER = 0.05, 5e-4  # unit lengths: so deep inside, any place is a void whose field is more
_AROUND = _BESIDE * np.concatenate([np.eye(3), -np.eye(3)])[:, None].astype(np.float32)
_STEPS, _FLAT = 4, 0.1  # of a walk to the surface; least squared slope that a step is taken by
_DEEPEST_BLEND = 0.08  # unit lengths: a quarter of the largest blend
OUTSIDE = 1.2  # times that sticking out counts, which is seen before what is missing
_ABOUT = 0.2  # unit lengths: how far from a point that is off a narrow hole, or what is missing, may reach
_PLACE = 0.2  # unit lengths, a ninth of the longest side: in several such cubes a part has several faults
_PLACES_A_SIDE = 64  # that are told apart: nothing lies further out
_MOST = np.float32(0.3)  # unit lengths that count in one place
_POWER = 4.0  # of the norm over places: near the largest, but with a word for the others


@dataclass(frozen=True)
class Deviations:
    """Where the surfaces of a shape and of an assembly are apart, further than the grid can be wrong.

    points: (n, 3), unit frame. distance: (n,) of the shape, signed. off: (n,) from the other surface, unit
    lengths; times `OUTSIDE` where the point lies outside of the shape. part: (n,) that the point lies on, or
    that is the nearest to it. parts: of the assembly.
    """

    points: Floats
    distance: Floats
    off: Floats
    part: NDArray[np.int64]
    parts: int

    @property
    def by_part(self) -> NDArray[np.float64]:
        """(M,) the largest of each part; 0 where it is nowhere off."""
        return largest(self.part, self.off, self.parts)

    @property
    def norm(self) -> float:
        """One length for all places, whatever is further off than a sixth of the longest side: with few parts
        overlaps tell what else is left out."""
        return norm(largest(places(self.part, self.points), np.minimum(self.off, _MOST)))

    def worst(self, part: int) -> int:
        """The point at which a part is furthest off."""
        mine = np.flatnonzero(self.part == part)
        return int(mine[self.off[mine].argmax()])

    def about(self, worst: int) -> tuple[Floats, Floats]:
        """Corners (3,) of a box around a point that sticks out or is missing, and what does so near it."""
        outside = self.distance > 0
        near = np.linalg.norm(self.points - self.points[worst], axis=1) < _ABOUT
        points = self.points[near & (outside == outside[worst])]
        return points.min(axis=0) - self.off[worst], points.max(axis=0) + self.off[worst]


def places(part: NDArray[np.int64], points: Floats) -> NDArray[np.int64]:
    """(n,) the place that points (n, 3) at which parts (n,) are off belong to.

    A part that is off in several places has several faults: if only its furthest counted, mending one of two
    that are as far off would be no gain.
    """
    half = _PLACES_A_SIDE // 2
    cube = np.clip(np.rint(points / _PLACE).astype(np.int64) + half, 0, _PLACES_A_SIDE - 1)
    shape = (int(part.max(initial=0)) + 1, *(3 * [_PLACES_A_SIDE]))
    code = np.ravel_multi_index((part, *cube.T), shape)
    return np.unique(code, return_inverse=True)[1].astype(np.int64)


def largest(of: NDArray[np.int64], off: Floats, count: int = 0) -> NDArray[np.float64]:
    """(P,) the largest of each part or place that points (n,) are of, at least so many; 0 where none is."""
    result = np.zeros(max(count, of.max(initial=-1) + 1))
    np.maximum.at(result, of, off)
    return result


def norm(off: NDArray[np.float64]) -> float:
    """One length for how far off several places are: near the largest."""
    return float((off**_POWER).sum() ** (1 / _POWER))


def deviations(samples: FitSamples, rows: Rows) -> Deviations:
    """Of an assembly, over points of its parts' surfaces and of the shape's."""
    added = np.flatnonzero(rows[:, Column.SIGN] > 0)
    surfaces = surface_points(rows)
    looks = (
        partial(of_parts, samples, rows, added, surfaces),
        partial(_of_shape, samples, rows, added),
        partial(of_voxels, samples, rows, added),
        partial(of_far_cells, samples, rows, added, surfaces[added]),
    )
    found = zip(*at_once(looks, samples.threads), strict=True)
    points, distance, off, part = (np.concatenate(one) for one in found)
    # At an edge, what is read off the grid may be wrong by half a voxel.
    kept = off > max(CLOSE, samples.grid.spacing / 2)
    off = np.where(distance > 0, np.float32(OUTSIDE), np.float32(1)) * off
    return Deviations(points[kept], distance[kept], off[kept], part[kept].astype(np.int64), len(rows))


def of_parts(
    samples: FitSamples,
    rows: Rows,
    added: NDArray[np.int64],
    surfaces: NDArray[np.float64],
    onto_blends: bool = False,
) -> tuple[NDArray[Any], ...]:
    """Points on the assembly's surface that stick out of the shape, or enclose a gap inside it.

    onto_blends: those under a blend walk onto it.
    """
    points = surfaces.astype(np.float32)
    part = np.repeat(np.arange(len(rows)), points.shape[1])
    points = points.reshape(-1, 3)
    field = samples.distance_of(rows, points)
    shown = np.abs(field) < ON
    # Under a blend the surface is further out than that of any part.
    under = np.flatnonzero((field <= -ON) & (field > -_DEEPEST_BLEND))
    under = under[(samples.parts_of(rows[added], points[under]) > -ON).all(axis=0)]
    shown[under] = True
    if onto_blends and len(under):
        points[under], field[under] = walked_to(samples, rows, points[under], field[under])
    points, field, part = points[shown], field[shown], part[shown]
    distance = samples.near_distance(points)
    off = np.where(distance > 0, distance - field, 0)
    # Deep inside, parts that touch leave no gap between them although the surfaces of both are met there.
    deep = np.flatnonzero(distance < -CLOSE)
    around = samples.distance_of(rows, (points[deep] + _AROUND).reshape(-1, 3)).reshape(len(_AROUND), -1)
    gap = deep[around.max(axis=0) > _BESIDE / 2]
    off[gap] = -distance[gap]
    return points, distance, off, part


def _of_shape(samples: FitSamples, rows: Rows, added: NDArray[np.int64]) -> tuple[NDArray[Any], ...]:
    """Points on the shape's surface that no part covers, and those deep under parts: walls of what is filled,
    which may be too narrow for its voxels to tell how deep it is."""
    field = samples.distance_of(rows, samples.surface)
    open_, filled = np.flatnonzero(field > CLOSE), np.flatnonzero(field < -CLOSE)
    gap = walked(samples, rows, samples.surface[open_], field[open_])
    index = np.concatenate([open_, filled])
    points, off = samples.surface[index], np.concatenate([gap, -field[filled]])
    part = added[samples.parts_of(rows[added], points).argmin(axis=0)]
    # What is filled lies outside of the shape, if only just.
    distance = np.repeat(np.array([0, ON], np.float32), [len(open_), len(filled)])
    return points, distance, off, part


def walked(samples: FitSamples, rows: Rows, points: Floats, gap: Floats) -> Floats:
    """How far points (n, 3) are from the surface of the assembly, whose field there is `gap` (n,).

    Beside thin, bent and blended parts the field is less than the distance: what is missing of a tip counted
    half. So points walk to the surface, and the way that they are off is measured.
    """
    place, field = walked_to(samples, rows, points, gap)
    return np.where(np.abs(field) < CLOSE, np.maximum(gap, np.linalg.norm(place - points, axis=1)), gap)


def walked_to(
    samples: FitSamples, rows: Rows, points: Floats, field: Floats, level: float | Floats = 0.0
) -> tuple[Floats, Floats]:
    """Where points (n, 3) come to that walk to the assembly's surface, or to other levels (n,) of its field,
    and that (n,) there."""
    place = points
    for _ in range(_STEPS):
        around = samples.distance_of(rows, (place + _AROUND).reshape(-1, 3)).reshape(len(_AROUND), -1)
        slope = ((around[:3] - around[3:]) / (2 * _BESIDE)).T
        steepness = np.maximum((slope**2).sum(axis=1), _FLAT)
        place = place - ((field - level) / steepness)[:, None] * slope
        field = samples.distance_of(rows, place)
    return place, field


def of_voxels(samples: FitSamples, rows: Rows, added: NDArray[np.int64]) -> tuple[NDArray[Any], ...]:
    """Places inside the shape that no part fills, and outside that one does.

    Where blends wall a void no part's surface is near it, and a hole may lie between the points of a face. A
    sheet passes between voxels: those beside it walk onto it.
    """
    points, distance = samples.lattice
    field = samples.lattice_field(rows)
    beside = np.flatnonzero((field > 0) & (field < samples.grid.spacing) & (distance - field > CLOSE))
    onto, field_there = walked_to(samples, rows, points[beside], field[beside])
    wrong = np.where(distance < 0, field, -field) > np.where(distance < -_DEEP, _SLIVER, _BESIDE / 2)
    onto = onto[np.abs(field_there) < CLOSE]
    deepest = samples.parts_of(rows[added], points[wrong]).argmin(axis=0)
    nearest = np.abs(samples.parts_of(rows[added], onto)).argmin(axis=0)
    points = np.concatenate([points[wrong], onto])
    distance = np.concatenate([distance[wrong], np.maximum(samples.near_distance(onto), 0)])
    return points, distance, np.abs(distance), added[np.concatenate([deepest, nearest])]


def of_far_cells(
    samples: FitSamples, rows: Rows, added: NDArray[np.int64], surfaces: NDArray[np.float64]
) -> tuple[NDArray[Any], ...]:
    """Places that an assembly fills further out than the lattice of voxels goes. surfaces: (M, K, 3) of the
    parts that are added.

    Of a part that reaches there and is mostly cut away chips may be left, between the points of all
    surfaces. Where one is between the middles of cells, too, those beside it walk onto it.
    """
    points = middles_within(samples.far_cells, surfaces.min(axis=1), surfaces.max(axis=1))
    points = points[:: 1 + len(points) // _MOST_FAR]
    field = samples.distance_of(rows, points)
    beside = np.flatnonzero((field > 0) & (field < CELL))
    onto, field_there = walked_to(samples, rows, points[beside], field[beside])
    points = np.concatenate([points[field < 0], onto[np.abs(field_there) < _SLIVER]])
    distance = samples.measure(points).astype(np.float32)
    part = np.abs(samples.parts_of(rows[added], points)).argmin(axis=0)
    return points, distance, np.maximum(distance, 0), added[part]
