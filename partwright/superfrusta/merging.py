"""Two touching parts become one where one explains as much: cures a limb that grew from both of its ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.fields import kernel
from partwright.superfrusta.evidence import Evidence, Rows
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.objective import occupancy_score, removal_scores, score
from partwright.superfrusta.pruning import neighbours
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.settings import Settings

_TOUCHING = 0.03  # unit lengths
_LOSS = 0.02  # of R: a merger that costs more before its refit is not tried
_FITTED = 20  # pairs that get a part fitted
_TRIED = 6  # of them, pairs that are tried with a refit


def merge(evidence: Evidence, rows: Rows, settings: Settings, locked: int = 0) -> Rows:
    """Replaces pairs by single parts while the objective does not fall; each pair's part is fitted afresh.

    Of the touching pairs, those with the least valuable member are fitted in one batch; the most promising
    are then tried one after another with a refit of their neighbours.
    """
    without, whole = removal_scores(evidence, rows)
    pairs = sorted(_touching_pairs(evidence, rows, locked), key=lambda p: (-max(without[list(p)]), p))[
        :_FITTED
    ]
    if not pairs:
        return rows
    owner = _owners(evidence, rows)
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
    occupied = kernel.evaluate_parts(rows, evidence.points, evidence.threads) < 0
    single = kernel.evaluate_parts(merged, evidence.points, evidence.threads) < 0
    kept = np.array([_without(evidence, occupied, pair) for pair in pairs])
    together: NDArray[np.bool_] = np.asarray(occupied.any(axis=0))
    estimate = np.subtract(occupancy_score(evidence, kept | single), occupancy_score(evidence, together))
    gone: set[int] = set()
    alive = np.arange(len(rows))
    for index in np.argsort(-estimate, kind="stable")[:_TRIED]:
        if estimate[index] < -_LOSS or gone & set(pairs[index]):
            continue
        first, second = (int(np.flatnonzero(alive == part)[0]) for part in pairs[index])
        trial, moving = _replaced(evidence, rows, first, second, merged[index])
        moving[:locked] = False
        trial = refine(evidence, trial, TOUCH_UP, settings, moving)
        reached = score(evidence, trial)
        if reached + settings.alpha >= whole:
            rows, whole = trial, reached
            gone |= set(pairs[index])
            alive = np.delete(alive, second)
    return rows


def _touching_pairs(evidence: Evidence, rows: Rows, locked: int) -> list[tuple[int, int]]:
    near = kernel.evaluate_parts(rows, evidence.points[::4], evidence.threads) < _TOUCHING
    inside = near[:, evidence.inside[::4]].astype(np.float32)
    shared = inside @ inside.T > 2
    return [(int(i), int(j)) for i, j in zip(*np.nonzero(np.triu(shared, 1)), strict=True) if i >= locked]


def _owners(evidence: Evidence, rows: Rows) -> NDArray[np.int64]:
    """The part (X * Y * Z,) that each voxel inside lies deepest in or nearest to; -1 outside the shape."""
    inside = np.flatnonzero(evidence.grid.values.ravel() < 0)
    owner = np.full(evidence.grid.values.size, -1, dtype=np.int64)
    distance = kernel.evaluate_parts(rows, evidence.grid_points[inside], evidence.threads)
    owner[inside] = distance.argmin(axis=0)
    return owner


def _depth(evidence: Evidence, owner: NDArray[np.int64], pair: tuple[int, int]) -> float:
    depths = evidence.grid.values.ravel()[np.isin(owner, pair)]
    return float(-depths.min()) if len(depths) else evidence.grid.spacing


def _without(evidence: Evidence, occupied: NDArray[np.bool_], pair: tuple[int, int]) -> NDArray[np.bool_]:
    others = np.ones(len(occupied), bool)
    others[list(pair)] = False
    return np.asarray(occupied[others].any(axis=0))


def _replaced(
    evidence: Evidence, rows: Rows, first: int, second: int, part: NDArray[np.float32]
) -> tuple[Rows, NDArray[np.bool_]]:
    """The rows with `part` in place of both, and which of them a refit should move."""
    moving = neighbours(evidence, rows, first) | neighbours(evidence, rows, second)
    moving[first] = True
    rows = rows.copy()
    rows[first] = part
    return np.delete(rows, second, axis=0), np.delete(moving, second)
