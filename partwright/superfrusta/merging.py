"""Two touching parts become one where one explains as much: cures a limb that grew from both of its ends."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from partwright.superfrusta.evidence import Evidence, Rows
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.objective import coverage, occupancy_score, removal_scores, score
from partwright.superfrusta.pruning import neighbours
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.settings import Settings

_TOUCHING = 0.03  # unit lengths
_LOSS = 0.02  # of R: a merger that costs more before its refit is not tried
_FITTED = 20  # pairs that get a part fitted
_TRIED = 6  # of them, pairs that are tried with a refit


@dataclass(frozen=True)
class Merger:
    """A pair of parts, the part that would replace both, and the estimated gain in R before any refit."""

    pair: tuple[int, int]
    part: NDArray[np.float32]
    gain: float


def merge(evidence: Evidence, rows: Rows, settings: Settings, locked: int = 0) -> Rows:
    """Replaces pairs by single parts while the objective does not fall.

    The most promising mergers are tried one after another with a refit of their neighbours.
    """
    whole = score(evidence, rows)
    gone: set[int] = set()
    alive = np.arange(len(rows))
    for merger in mergers(evidence, rows, settings, locked)[:_TRIED]:
        if merger.gain < -_LOSS or gone & set(merger.pair):
            continue
        first, second = (int(np.flatnonzero(alive == part)[0]) for part in merger.pair)
        trial = _carried_out(evidence, rows, first, second, merger.part, settings, locked)
        reached = score(evidence, trial)
        if reached + settings.alpha >= whole:
            rows, whole = trial, reached
            gone |= set(merger.pair)
            alive = np.delete(alive, second)
    return rows


def cheapest_merger(
    evidence: Evidence, rows: Rows, settings: Settings, locked: int = 0
) -> tuple[Rows, float] | None:
    """The assembly with one pair merged that keeps the most of `coverage`, and that; None for a single part.

    Any two parts may merge, near or far: a pair of legs into one block.
    """
    best: tuple[Rows, float] | None = None
    for merger in mergers(evidence, rows, settings, locked, apart=True)[: 2 * settings.trials]:
        trial = _carried_out(evidence, rows, *merger.pair, merger.part, settings, locked)
        reached = coverage(evidence, trial)
        if best is None or reached > best[1]:
            best = trial, reached
    return best


def mergers(
    evidence: Evidence, rows: Rows, settings: Settings, locked: int, apart: bool = False
) -> list[Merger]:
    """Best first. Of the pairs that touch, or of all where they may lie apart, those with the least valuable
    member are fitted, in one batch."""
    without, _ = removal_scores(evidence, rows)
    found = list(combinations(range(len(rows)), 2)) if apart else _touching_pairs(evidence, rows)
    value = {pair: float(-max(without[list(pair)])) for pair in found if pair[0] >= locked}
    owner = _owners(evidence, rows)
    pairs = [p for p in sorted(value, key=lambda p: (value[p], p)) if np.isin(owner, p).any()][:_FITTED]
    if not pairs:
        return []
    regions = [
        Region(
            np.isin(owner, pair),
            np.delete(rows, pair, axis=0),
            _depth(evidence, owner, pair),
            margin=0.2,
            elsewhere=0.15,
            frames=rows[list(pair), 3:7],
        )
        for pair in pairs
    ]
    merged = fit_regions(evidence, regions, settings, settings.overlap)
    occupied = evidence.parts_of(rows, evidence.points) < 0
    single = evidence.parts_of(merged, evidence.points) < 0
    kept = np.array([_without(occupied, pair) for pair in pairs])
    together: NDArray[np.bool_] = np.asarray(occupied.any(axis=0))
    gains = np.subtract(occupancy_score(evidence, kept | single), occupancy_score(evidence, together))
    return [Merger(pairs[i], merged[i], float(gains[i])) for i in np.argsort(-gains, kind="stable")]


def _touching_pairs(evidence: Evidence, rows: Rows) -> list[tuple[int, int]]:
    near = evidence.parts_of(rows, evidence.points[::4]) < _TOUCHING
    inside = near[:, evidence.inside[::4]].astype(np.float32)
    shared = inside @ inside.T > 2
    return [(int(i), int(j)) for i, j in zip(*np.nonzero(np.triu(shared, 1)), strict=True)]


def _owners(evidence: Evidence, rows: Rows) -> NDArray[np.int64]:
    """The part (X * Y * Z,) that each voxel inside lies deepest in or nearest to; -1 outside the shape."""
    inside = np.flatnonzero(evidence.grid.values.ravel() < 0)
    owner = np.full(evidence.grid.values.size, -1, dtype=np.int64)
    distance = evidence.parts_of(rows, evidence.grid_points[inside])
    owner[inside] = distance.argmin(axis=0)
    return owner


def _depth(evidence: Evidence, owner: NDArray[np.int64], pair: tuple[int, int]) -> float:
    depths = evidence.grid.values.ravel()[np.isin(owner, pair)]
    return float(-depths.min()) if len(depths) else evidence.grid.spacing


def _without(occupied: NDArray[np.bool_], pair: tuple[int, int]) -> NDArray[np.bool_]:
    others = np.ones(len(occupied), bool)
    others[list(pair)] = False
    return np.asarray(occupied[others].any(axis=0))


def _carried_out(
    evidence: Evidence,
    rows: Rows,
    first: int,
    second: int,
    part: NDArray[np.float32],
    settings: Settings,
    locked: int,
) -> Rows:
    """The rows with `part` in place of both, it and its neighbours refitted."""
    moving = neighbours(evidence, rows, first) | neighbours(evidence, rows, second)
    moving[first] = True
    moving[:locked] = False
    merged = rows.copy()
    merged[first] = part
    return refine(evidence, np.delete(merged, second, axis=0), TOUCH_UP, settings, np.delete(moving, second))
