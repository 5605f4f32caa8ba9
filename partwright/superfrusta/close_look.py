"""How far an assembly and a shape are apart, seen as closely as the report measures it.

A search looks hundreds of times, at few points, and takes the field for the distance: in a crease that is
filled the field of the parts beside it is a fraction of that.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.at_once import at_once, share_of, thread_count
from partwright.fields.columns import Column
from partwright.metrics.deviation import buried
from partwright.shapes import Shape
from partwright.superfrusta.deviations import (
    CLOSE,
    ON,
    Deviations,
    of_far_cells,
    of_parts,
    of_voxels,
    walked_to,
)
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.samples import FitSamples, Rows

Floats = NDArray[np.float32]

_DRAWN = 14_000  # points of the shape's surface
_CORNERS = 10_000  # of the input's vertices, at most
_NOTHING = 1e-3  # unit lengths: what reaches no deeper is as good as not there
_LOOSE = 1.25  # times the field: where a walk was longer, it need not have ended at what is nearest
_AMONG_FURTHEST = 0.7  # of the furthest: so far are those that are looked at once more
_SLOPE = 2.5  # times that a part's field outside may be less than the distance, where it is bent or tapers
_BLENDED = 0.02  # unit lengths: a blend covers as much between parts
_AGAIN = 40  # points at once, thrice at most
_TIMES = 3
_FELT = 0.5  # of what is furthest off in the whole: less adds a sixteenth at most to the norm over parts
_WAYS, _SHELLS = 64, 12  # from a point outwards, and distances that are tried in each
_CLIMBED, _PLACE = 32, 0.06  # places beside which others may stick out further, at most, and their side
_CLIMB_WAYS, _CLIMB = 14, (0.03, 0.015, 0.008, 0.004)  # ways from each, and steps in unit lengths
STICKS_OUT = 1.8  # times that sticking out counts, which is seen first: more than in a search


@dataclass(frozen=True)
class Seen(Deviations):
    """times: (n,) that each point's length counts in `off`."""

    times: Floats


@dataclass
class CloseLook:
    """Points (N, 3) of a shape's surface, corners included, at which assemblies are looked at.

    Which of them cannot be seen, as they lie in cracks, is found out where it matters.
    """

    samples: FitSamples
    points: Floats
    _shown: NDArray[np.bool_] = field(init=False)
    _asked: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        self._shown = np.ones(len(self.points), bool)
        self._asked = np.zeros(len(self.points), bool)

    @classmethod
    def at(cls, shape: Shape, samples: FitSamples) -> CloseLook:
        corners = shape.frame.to_unit(shape.vertices).astype(np.float32)
        corners = corners[:: -(-len(corners) // _CORNERS)]
        drawn = shape.unit_surface(_DRAWN, samples.seed).points.astype(np.float32)
        return cls(samples, np.concatenate([drawn, corners]))

    def deviations(self, rows: Rows) -> Seen:
        """Of an assembly."""
        added = np.flatnonzero(rows[:, Column.SIGN] > 0)
        surfaces = surface_points(rows)
        samples, on_parts = self.samples, surfaces.reshape(-1, 3).astype(np.float32)
        looks = (
            partial(of_parts, samples, rows, added, surfaces, onto_blends=True),
            partial(of_voxels, samples, rows, added),
            partial(of_far_cells, samples, rows, added, surfaces[added]),
            partial(self._of_surfaces, rows, on_parts),
        )
        *of_solid, (field, on_it) = at_once(looks, samples.threads)
        points, distance, off, part = (np.concatenate(one) for one in zip(*of_solid, strict=True))
        off = self._exactly(points, distance, off)
        beside = self._beside(rows, points, distance, off, part)
        joined = zip((points, distance, off, part), beside, strict=True)
        points, distance, off, part = (np.concatenate(one) for one in joined)
        least = max(CLOSE, _FELT * float(off.max(initial=0)))
        of_shape = self._of_shape(rows, added, field, on_it, least)
        times = np.where(distance > 0, np.float32(STICKS_OUT), np.float32(1))
        both = zip((points, distance, off, part, times), (*of_shape, np.ones_like(of_shape[2])), strict=True)
        points, distance, off, part, times = (np.concatenate(one) for one in both)
        kept = off > max(CLOSE, self.samples.grid.spacing / 2)
        points, distance, off, part, times = (one[kept] for one in (points, distance, off, part, times))
        return Seen(points, distance, times * off, part.astype(np.int64), len(rows), times)

    def _exactly(self, points: Floats, distance: Floats, off: Floats) -> Floats:
        """How far (n,) the solid is off at points (n, 3), exactly where it sticks out the furthest: what is
        read off the grid may be wrong by half a voxel."""
        result = off.copy()
        outside = distance > 0
        furthest = np.flatnonzero(outside & (off > _AMONG_FURTHEST * off[outside].max(initial=0)))
        if len(furthest):
            result[furthest] = self.samples.away(points[furthest])
        return result

    def _beside(
        self, rows: Rows, points: Floats, distance: Floats, off: Floats, part: NDArray[np.int64]
    ) -> tuple[NDArray[Any], ...]:
        """Where what sticks out does so the furthest, beside points that do: those of a part's surface may be
        as far apart as a tenth of it."""
        samples, outside = self.samples, distance > 0
        far = np.flatnonzero(outside & (off > _FELT * off[outside].max(initial=0)))
        far = far[np.argsort(-off[far], kind="stable")]
        places = np.column_stack([part[far], np.floor(points[far] / _PLACE).astype(np.int64)])
        _, first = np.unique(places, axis=0, return_index=True)
        far = far[np.sort(first)[:_CLIMBED]]
        place, best = points[far], off[far]
        for radius in _CLIMB if len(far) else ():
            around = (place[:, None] + radius * _ways(_CLIMB_WAYS)).reshape(-1, 3)
            onto, field = walked_to(samples, rows, around, samples.distance_of(rows, around))
            # Half a voxel matters here: what is read off the grid only tells which are outside.
            there = np.zeros(len(onto), np.float32)
            outside = (np.abs(field) < ON / 2) & (samples.near_distance(onto) > 0)
            there[outside] = samples.away(onto[outside])
            index = np.arange(len(far)), there.reshape(len(far), -1).argmax(axis=1)
            onto, there = onto.reshape(len(far), -1, 3)[index], there.reshape(len(far), -1)[index]
            better = there > best
            place, best = np.where(better[:, None], onto, place), np.where(better, there, best)
        moved = best > off[far]
        place, best = place[moved].astype(np.float32), best[moved].astype(np.float32)
        return place, best, best, part[far[moved]]

    def _of_surfaces(self, rows: Rows, on_parts: Floats) -> tuple[Floats, Floats]:
        """The assembly's field (N,) at the shape's points, and those (K, 3) of its parts that are on its own
        surface."""
        field, there = (self.samples.distance_of(rows, points) for points in (self.points, on_parts))
        # Just above zero nothing may be left: a cut ends there that goes a little beyond the part.
        return field, on_parts[(there > -ON) & (there < _NOTHING)]

    def _of_shape(
        self, rows: Rows, added: NDArray[np.int64], field: Floats, on_it: Floats, least: float
    ) -> tuple[NDArray[Any], ...]:
        """Points of the shape's surface further than `least` from the assembly's, filled or not covered.

        field: (N,) there. on_it: (K, 3) of the assembly's surface.
        """
        samples = self.samples
        mine = self._suspects(rows[added], field, least)
        if not len(mine) or not len(on_it):
            return self.points[:0], field[:0], field[:0], added[:0]
        # Between the points of the assembly's surface these are rather too far than too near.
        tree = cKDTree(on_it, balanced_tree=False, compact_nodes=False)  # a few queries are not worth those
        threads = thread_count(share_of(samples.threads))
        away, _ = tree.query(self.points[mine], distance_upper_bound=least, workers=threads)
        mine = mine[np.isinf(away)]
        points, field = self.points[mine], field[mine]
        nearest = np.maximum(tree.query(points, workers=threads)[0], np.abs(field))
        off = self._measured(rows, points, field, nearest)
        far = off > least
        mine, points, field, off = mine[far], points[far], field[far], off[far]
        seen = self._seen(mine, off)
        points, field, off = points[seen], field[seen], off[seen]
        part = added[samples.parts_of(rows[added], points).argmin(axis=0)] if len(points) else added[:0]
        # What is filled lies outside of the shape, if only just.
        return points, np.where(field < 0, np.float32(ON), np.float32(0)), off, part

    def _suspects(self, added: Rows, field: Floats, least: float) -> NDArray[np.int64]:
        """Points that may be further than `least`, by the field (N,) there: where parts meet, it may be any
        fraction of what is filled. Then another part is as near as the nearest one's surface."""
        suspects = ((field > least / _SLOPE) | (field < -least)) & self._shown
        filled = np.flatnonzero((field < -ON / 2) & ~suspects & self._shown)
        if len(added) > 1 and len(filled):
            apart = np.partition(self.samples.parts_of(added, self.points[filled]), 1, axis=0)[1]
            suspects[filled[apart < _BLENDED - field[filled]]] = True
        return np.flatnonzero(suspects)

    def _measured(self, rows: Rows, points: Floats, field: Floats, most: Floats) -> Floats:
        """How far (n,) points (n, 3) are from the assembly's surface, that is at most so far (n,): by the way
        that they walk to it, and by looking around where that may be another than the shortest."""
        if not len(points):
            return field
        # What is missing is as far off as something is beneath the surface: a cut may leave nothing there.
        level = np.where(field < 0, np.float32(0), np.float32(-_NOTHING))
        place, there = walked_to(self.samples, rows, points, field, level)
        arrived = (np.abs(there) < CLOSE / 2) & ((field < 0) | (there < 0))
        way = np.where(arrived, np.linalg.norm(place - points, axis=1), np.inf)
        off = np.clip(way, np.abs(field), most)
        loose = way > _LOOSE * np.abs(field)
        for _ in range(_TIMES):
            again = np.flatnonzero(loose & (off > _AMONG_FURTHEST * off.max()))
            if not len(again):
                break
            again = again[np.argsort(-off[again], kind="stable")[:_AGAIN]]
            off[again] = self._around(rows, points[again], field[again], off[again])
            loose[again] = False
        return np.asarray(off, np.float32)

    def _around(self, rows: Rows, points: Floats, field: Floats, most: Floats) -> Floats:
        """How far (n,) from points (n, 3) the assembly begins or ends, in one of many ways."""
        least = np.abs(field)
        share = np.arange(1, _SHELLS + 1, dtype=np.float32) / _SHELLS
        radius = least[:, None] + (most - least)[:, None] * share
        places = points[:, None, None] + radius[:, :, None, None] * _ways(_WAYS)
        there = self.samples.distance_of(rows, np.ascontiguousarray(places.reshape(-1, 3), np.float32))
        across = (there >= 0).reshape(*radius.shape, _WAYS) != (field >= 0)[:, None, None]
        found = across.any(axis=2)
        return np.where(found.any(axis=1), radius[np.arange(len(points)), found.argmax(axis=1)], most)

    def _seen(self, index: NDArray[np.int64], off: Floats) -> NDArray[np.bool_]:
        """Which of the points with these indices (n,) can be seen; those that are far less off (n,) than any
        that can are not asked for."""
        while True:
            shown = self._shown[index]
            furthest = off > _AMONG_FURTHEST * off[shown].max(initial=0)
            asked = index[shown & furthest & ~self._asked[index]]
            if not len(asked):
                return shown
            self._asked[asked] = True
            self._shown[asked] = ~buried(self.samples.measure, self.points[asked])


@cache
def _ways(number: int) -> Floats:
    """Unit vectors (number, 3), evenly about a point, on a spiral."""
    count = np.arange(number) + 0.5
    up, turn = 1 - 2 * count / number, np.pi * (1 + 5**0.5) * count
    aside = np.sqrt(1 - up**2)
    return np.stack([aside * np.cos(turn), aside * np.sin(turn), up], axis=1).astype(np.float32)
