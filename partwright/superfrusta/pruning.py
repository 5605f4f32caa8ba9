"""Fewer parts: removals that the objective rewards, alone or followed by a refit of the neighbours."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from partwright.at_once import at_once
from partwright.fields.columns import Column
from partwright.superfrusta.objective import removal_scores, score
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

_TOUCHING = 0.06  # unit lengths within which parts count as neighbours


def prune(samples: FitSamples, rows: Rows, alpha: float, locked: int = 0) -> Rows:
    """Removes parts one by one while the objective R - alpha * parts does not fall (section 3.4, Pruning)."""
    while len(rows) > max(1, locked):
        without, whole = removal_scores(samples, rows)
        without[~_removable(rows, locked)] = -np.inf
        worst = int(without.argmax())
        if without[worst] + alpha < whole:
            break
        rows = np.delete(rows, worst, axis=0)
    return rows


def drop_least(samples: FitSamples, rows: Rows, locked: int = 0) -> Rows:
    """The assembly without the part that R misses least."""
    without, _ = removal_scores(samples, rows)
    without[~_removable(rows, locked)] = -np.inf
    return np.delete(rows, int(without.argmax()), axis=0)


def cheapest_removal(
    samples: FitSamples,
    rows: Rows,
    settings: Settings,
    locked: int = 0,
    measure: Callable[[FitSamples, Rows], float] = score,
) -> tuple[Rows, float, float]:
    """The assembly with one part less that keeps the most of `measure` after its neighbours are refitted.

    Returns it with its measure, and the R of the assembly as given. `settings.trials` parts are tried.
    """
    without, whole = removal_scores(samples, rows)
    without[~_removable(rows, locked)] = -np.inf

    def removed(index: int) -> tuple[Rows, float]:
        moving = neighbours(samples, rows, index)
        moving[:locked] = False
        thinned = refine(
            samples, np.delete(rows, index, axis=0), TOUCH_UP, settings, np.delete(moving, index)
        )
        return thinned, measure(samples, thinned)

    first = np.argsort(-without, kind="stable")[: settings.trials]
    tried = [partial(removed, int(index)) for index in first if np.isfinite(without[index])]
    found = at_once(tried, samples.threads)
    if not found:
        return rows, whole, whole
    return *max(found, key=lambda one: one[1]), whole


def _removable(rows: Rows, locked: int) -> NDArray[np.bool_]:
    """Parts (M,) that are not locked, and not the only one from which others are subtracted."""
    added = rows[:, Column.SIGN] > 0
    free = np.arange(len(rows)) >= locked
    return free & ~(added & (np.count_nonzero(added) == 1) & (len(rows) > 1))


def neighbours(samples: FitSamples, rows: Rows, index: int) -> NDArray[np.bool_]:
    """Parts (M,) that come near the given one, itself not counted."""
    distance = samples.parts_of(rows, samples.points[::8])
    around = np.abs(distance[index]) < _TOUCHING
    near: NDArray[np.bool_] = np.asarray((distance[:, around] < _TOUCHING).any(axis=1))
    near[index] = False
    return near
