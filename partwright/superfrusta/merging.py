"""Two touching parts become one where one explains as much: cures a limb that grew from both of its ends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.at_once import at_once, in_turn
from partwright.fields.columns import ROTATION, Column
from partwright.meshing.hulls import hull_volume
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.objective import coverage, occupancy_score, removal_scores, score
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.pruning import neighbours
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

_TOUCHING = 0.03  # unit lengths
_UNREFITTED_SCORE_LOSS = 0.02  # of R: a merger that costs more before its refit is not tried
_FITTED = 16  # pairs that get a part fitted: those with the least valuable member
_FILLED = 6  # and those that fill their convex hull best
_FULL = 0.85  # share of the hull that these fill, at least
_TRIED = 6  # of them, pairs that are tried with a refit


@dataclass(frozen=True)
class Merger:
    """A pair of parts, the part that would replace both, and the estimated gain in R before any refit."""

    pair: tuple[int, int]
    part: NDArray[np.float32]
    gain: float


def merge(samples: FitSamples, rows: Rows, settings: Settings, locked: int = 0) -> Rows:
    """Replaces pairs by single parts while the objective does not fall.

    The most promising mergers are tried one after another with a refit of their neighbours.
    """
    whole = score(samples, rows)
    alive = np.arange(len(rows))  # which of the parts as they were each row is; -1: a merged one

    def merged(merger: Merger) -> tuple[Rows, float]:
        first, second = (int(np.flatnonzero(alive == part)[0]) for part in merger.pair)
        trial = carried_out(samples, rows, first, second, merger.part, settings, locked)
        return trial, score(samples, trial)

    first = mergers(samples, rows, settings, locked)[:_TRIED]
    left = [one for one in first if one.gain >= -_UNREFITTED_SCORE_LOSS]
    while left:
        tried = in_turn([partial(merged, one) for one in left], samples.threads)
        for index, (trial, reached) in enumerate(tried):
            if reached + settings.alpha >= whole:
                # Those that come after it are tried beside it.
                rows, whole, pair = trial, reached, left[index].pair
                alive[alive == pair[0]] = -1
                alive = alive[alive != pair[1]]
                left = [one for one in left[index + 1 :] if np.isin(one.pair, alive).all()]
                break
        else:
            break
    return rows


def cheapest_merger(
    samples: FitSamples, rows: Rows, settings: Settings, locked: int = 0
) -> tuple[Rows, float] | None:
    """The assembly with one pair merged that keeps the most of `coverage`, and that; None for a single part.

    Any two parts may merge, near or far: a pair of legs into one block.
    """

    def merged(merger: Merger) -> tuple[Rows, float]:
        trial = carried_out(samples, rows, *merger.pair, merger.part, settings, locked)
        return trial, coverage(samples, trial)

    tried = mergers(samples, rows, settings, locked, apart=True)[: 2 * settings.trials]
    found = at_once([partial(merged, one) for one in tried], samples.threads)
    return max(found, key=lambda one: one[1], default=None)


def mergers(
    samples: FitSamples, rows: Rows, settings: Settings, locked: int, apart: bool = False
) -> list[Merger]:
    """Best first. Of the pairs that touch, or of all where they may lie apart, those with the least valuable
    member are fitted, and those that together are nearly convex: a plank in two halves, each of which is
    worth much. All in one batch."""
    without, _ = removal_scores(samples, rows)
    touching = _touching_pairs(samples, rows)
    owner = owners(samples, rows)
    owning = np.isin(np.arange(len(rows)), owner)

    def suited(pair: tuple[int, int]) -> bool:
        alike = rows[pair[0], Column.SIGN] == rows[pair[1], Column.SIGN]
        return bool(alike and pair[0] >= locked and owning[list(pair)].any())

    every = list(filter(suited, combinations(range(len(rows)), 2) if apart else touching))
    cheap = sorted(every, key=lambda pair: (-max(without[list(pair)]), pair))[:_FITTED]
    others = [pair for pair in touching if suited(pair) and pair not in cheap]
    filled = _hulls_filled(rows, others, samples.threads)
    full = [pair for pair in sorted(filled, key=lambda pair: -filled[pair]) if filled[pair] > _FULL]
    pairs = cheap + full[:_FILLED]
    if not pairs:
        return []
    regions = [
        Region(
            voxels := (owner == pair[0]) | (owner == pair[1]),
            np.delete(rows, pair, axis=0),
            _depth(samples, voxels),
            margin=0.2,
            elsewhere=0.15,
            frames=rows[list(pair), ROTATION],
            sign=float(rows[pair[0], Column.SIGN]),
            under=bool((rows[np.delete(np.arange(len(rows)), pair), Column.SIGN] < 0).any()),
        )
        for pair in pairs
    ]
    merged = fit_regions(samples, regions, settings, settings.overlap)
    occupied = samples.covered_by(rows, samples.points)
    single = samples.covered_by(merged, samples.points)
    added = rows[:, Column.SIGN] > 0
    trials = [
        folded(_replaced(occupied, *pair, one), np.delete(added, pair[1]))
        for pair, one in zip(pairs, single, strict=True)
    ]
    together = folded(occupied, added)
    gains = np.subtract(occupancy_score(samples, np.array(trials)), occupancy_score(samples, together))
    return [Merger(pairs[i], merged[i], float(gains[i])) for i in np.argsort(-gains, kind="stable")]


def _hulls_filled(rows: Rows, pairs: list[tuple[int, int]], threads: int) -> dict[tuple[int, int], float]:
    """The volume of both parts' convex hulls, by that of the hull of both."""
    parts = sorted({i for pair in pairs for i in pair})
    points = {part: surface_points(rows[[part]])[0] for part in parts}
    bodies = [points[part] for part in parts] + [np.concatenate([points[i], points[j]]) for i, j in pairs]
    volumes = at_once([partial(hull_volume, body) for body in bodies], threads)
    own = dict(zip(parts, volumes, strict=False))
    both = zip(pairs, volumes[len(parts) :], strict=True)
    return {(i, j): (own[i] + own[j]) / max(volume, 1e-12) for (i, j), volume in both}


def _touching_pairs(samples: FitSamples, rows: Rows) -> list[tuple[int, int]]:
    near = samples.parts_of(rows, samples.points[::4]) < _TOUCHING
    inside = samples.inside[::4]
    near &= np.where(rows[:, Column.SIGN, None] > 0, inside, ~inside)
    shared = near.astype(np.float32) @ near.T.astype(np.float32) > 2
    return [(int(i), int(j)) for i, j in zip(*np.nonzero(np.triu(shared, 1)), strict=True)]


def owners(samples: FitSamples, rows: Rows) -> NDArray[np.int64]:
    """The part (X * Y * Z,) that each voxel inside the shape lies deepest in or nearest to; -1 outside.

    Voxels outside that parts would cover belong to those that are subtracted there.
    """
    inside = samples.grid.values.ravel() < 0
    owner = np.full(len(inside), -1, dtype=np.int64)
    added = rows[:, Column.SIGN] > 0
    voxels = np.flatnonzero(inside)
    owner[voxels] = _nearest(samples, rows, np.flatnonzero(added), samples.grid_points[voxels])
    if not added.all():
        voxels = np.flatnonzero(~inside)
        # With its blends the union of what is added covers no less than its parts do.
        voxels = voxels[samples.distance_of(rows[added], samples.grid_points[voxels]) < 0]
        covered = samples.covered_by(rows[added], samples.grid_points[voxels]).any(axis=0)
        voxels = voxels[covered]
        owner[voxels] = _nearest(samples, rows, np.flatnonzero(~added), samples.grid_points[voxels])
    return owner


def _nearest(
    samples: FitSamples, rows: Rows, among: NDArray[np.int64], points: NDArray[np.float32]
) -> NDArray[np.int64]:
    """Which of the rows `among` (K,) each point (n, 3) lies deepest in or nearest to; the first of equals."""
    nearest = np.full(len(points), among[0])
    least, *others = samples.parts_of(rows[among], points)
    for index, distance in zip(among[1:], others, strict=True):
        nearest[distance < least] = index
        np.minimum(least, distance, out=least)
    return nearest


def _depth(samples: FitSamples, voxels: NDArray[np.bool_]) -> float:
    depths = np.abs(samples.grid.values.ravel()[voxels])
    return float(depths.max()) if len(depths) else samples.grid.spacing


def _replaced(rows: Any, first: int, second: int, part: Any) -> Any:
    """The rows (M, ...) with `part` (...) in place of both."""
    merged = rows.copy()
    merged[first] = part
    return np.delete(merged, second, axis=0)


def folded(occupied: NDArray[np.bool_], added: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Occupancy (N,) of parts (M, N) joined from first to last without blends."""
    if added.all():
        return np.asarray(occupied.any(axis=0))
    result = np.zeros(occupied.shape[1], bool)
    for one, plus in zip(occupied, added, strict=True):
        result = result | one if plus else result & ~one
    return result


def carried_out(
    samples: FitSamples,
    rows: Rows,
    first: int,
    second: int,
    part: NDArray[np.float32],
    settings: Settings,
    locked: int,
    alone: bool = False,
) -> Rows:
    """The rows with `part` in place of both, it and its neighbours refitted, or it alone."""
    moving = np.zeros(len(rows), bool)
    if not alone:
        moving = neighbours(samples, rows, first) | neighbours(samples, rows, second)
    moving[first] = True
    moving[:locked] = False
    merged = _replaced(rows, first, second, part)
    return refine(samples, merged, TOUCH_UP, settings, np.delete(moving, second))
