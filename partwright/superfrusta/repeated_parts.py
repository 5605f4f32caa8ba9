"""Repeats: parts that a symmetry of the shape takes to one another become one leaf with several instances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from partwright.at_once import at_once
from partwright.superfrusta.deviations import deviations, norm
from partwright.superfrusta.local_repeats import LOCAL_TOLERANCE, local_repeats
from partwright.superfrusta.objective import score
from partwright.superfrusta.repeat_candidates import Occupancies, Repeat, repeat_candidates, whole_sides
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded, refit
from partwright.superfrusta.symmetry import TOLERANCE, Symmetry, groups

_TRIED = 64  # repeats at most
_NEARLY = 1  # planes, the most exact first, that are tried part by part
_PLANES = 2  # likewise, of which all on one side is tried for all on the other
_GIVEN_UP = 1  # of those that are chosen, at most
_UNREFITTED_SCORE_LOSS = 0.01  # of R: what a repeat may cost before a refit beyond the parts that it saves
_UNREFITTED_OFF = 0.03  # unit lengths: so much more than before a part may be off before a refit
_GRID_EVERY = 3
_HOPELESS = 0.004  # of the value: what is so much worse after a brief refit gets no longer one
_FURTHER = 0.009  # unit lengths, half a percent of the longest side: likewise, after it
_NEAR = 0.045  # unit lengths, 2.5 % of the longest side: what is no further off is left to the last steps
_LOOSER = (
    2.0  # times the median distance from the surface to the assembly, which what is missing hardly moves
)
_REFITS = (((100.0, 6),), ((40.0, 4), (100.0, 8), (200.0, 8)))


@dataclass(frozen=True)
class Trial:
    """An assembly as leaves, the `value` that mending serves with a price for each leaf, and the most that a
    part is off, unit lengths."""

    leaves: list[RepeatedPart]
    value: float
    off: float


def repeat(
    samples: FitSamples,
    rows: Rows,
    found: Sequence[Symmetry],
    settings: Settings,
    locked: int = 0,
    nearly: Sequence[Symmetry] = (),
) -> list[RepeatedPart]:
    """The assembly as leaves, of which those that repeat under the symmetries, or in several places, are one
    each. A plane that holds only `nearly` for the whole may hold for a part after a small motion.

    Repeats are taken that are worth the most: the parts that they save, less what they cost of R; or all that
    is on one side of a plane stands for the other. The copies of each leaf are refitted as one. Together they
    may not lower the objective by more than a part's price, nor leave a part further off than 2.5 % of the
    longest side and than any was by over half a percent; where they do, they are given up one by one. Of what
    is worth the most, to within that price, there are as few leaves as can be.
    An IoU that the settings ask for is kept. The first `locked` rows stay leaves of their own.
    """
    whole = measured(samples, _leaves(rows, []), settings)
    furthest = max(whole.off + _FURTHER, _NEAR)

    def good(trial: Trial) -> bool:
        if trial.off > furthest or trial.value < whole.value - settings.alpha:
            return False
        if settings.min_iou is None:
            return True
        return _grid_iou(samples, trial) >= min(_grid_iou(samples, whole), settings.min_iou)

    candidates: list[Trial] = []
    tolerance = max(LOCAL_TOLERANCE, symmetry_tolerance(samples, rows))
    seen = Occupancies.of(samples, rows)
    wanted = repeat_candidates(seen, groups(found), locked)
    mirrors = [one.isometry for one in nearly if one.kind == "mirror"]
    wanted += local_repeats(seen, locked, tolerance, mirrors[:_NEARLY])
    planes = [one for one in found if one.kind == "mirror"]
    sides = whole_sides(seen, planes[:_PLANES], locked)

    def refitted(chosen: Sequence[Repeat]) -> list[Trial]:
        trials = [measured(samples, _leaves(rows, chosen), settings)]
        # Which is far from its best until it is refitted twice.
        of_side = any(chosen[0] is side for side in sides)
        for stages in _REFITS:
            start = trials[-1 if of_side else 0]
            leaves = refit(samples, start.leaves, stages, settings, locked)
            trials.append(measured(samples, leaves, settings))
            nearer = trials[-1].off <= furthest + _FURTHER
            if not of_side and (not nearer or trials[-1].value < whole.value - _HOPELESS):
                break
        return trials

    choices = _choices(samples, whole, wanted, settings) + [[side] for side in sides]
    tried = at_once([partial(refitted, chosen) for chosen in choices], samples.threads)
    for chosen, first in zip(choices, tried, strict=True):
        for left in range(_GIVEN_UP, -1, -1):
            trials = first if left == _GIVEN_UP else refitted(chosen)
            candidates += [trial for trial in trials if good(trial)]
            if candidates or len(chosen) == 1 or not left:
                break
            chosen = _without_the_worst(samples, rows, chosen, settings)
    return _fewest([whole, *candidates], settings.alpha).leaves


def _fewest(trials: Sequence[Trial], equal: float) -> Trial:
    """The one with the fewest leaves of those whose value is within so much of the most: which of them has
    that is chance."""
    least = max(trial.value for trial in trials) - equal
    nearly = [trial for trial in trials if trial.value >= least]
    return min(nearly, key=lambda trial: (len(trial.leaves), -trial.value))


def symmetry_tolerance(samples: FitSamples, rows: Rows) -> float:
    """Mean distance of a shape's surface from its image, unit lengths, up to which it counts as symmetric.

    A symmetry need not hold better than the assembly fits: a scan or a generated mesh is alike on both sides
    but for its noise, which no part follows.
    """
    residual = np.median(np.abs(samples.distance_of(rows, samples.surface)))
    return max(TOLERANCE, _LOOSER * float(residual))


def _without_the_worst(
    samples: FitSamples, rows: Rows, chosen: Sequence[Repeat], settings: Settings
) -> list[Repeat]:
    rest = [[other for other in chosen if other is not one] for one in chosen]
    trials = at_once(
        [partial(measured, samples, _leaves(rows, some), settings) for some in rest], samples.threads
    )
    return max(zip(rest, trials, strict=True), key=lambda one: one[1].value)[0]


def measured(
    samples: FitSamples, leaves: list[RepeatedPart], settings: Settings, price: float = 1.0
) -> Trial:
    """Of copies the one that is furthest off counts. price: of a leaf, in parts'."""
    rows = expanded(leaves)
    firsts = np.cumsum([0, *(1 + len(leaf.isometries) for leaf in leaves[:-1])])
    off = np.maximum.reduceat(deviations(samples, rows).by_part, firsts)
    value = score(samples, rows) - price * settings.alpha * len(leaves) - settings.firmness * norm(off)
    return Trial(leaves, value, float(off.max()))


def _grid_iou(samples: FitSamples, trial: Trial) -> float:
    """On the grid: a refit leans towards the samples that it saw."""
    occupied = samples.distance_of(expanded(trial.leaves), samples.grid_points[::_GRID_EVERY]) < 0
    inside = samples.grid.values.ravel()[::_GRID_EVERY] < 0
    both, either = int((occupied & inside).sum()), int((occupied | inside).sum())
    return both / max(either, 1)


def _choices(
    samples: FitSamples, whole: Trial, wanted: list[Repeat], settings: Settings
) -> list[list[Repeat]]:
    """Repeats that get along, in several ways, none twice.

    Those are taken first that are worth the most by themselves, that save the most for what they cost of R
    before a refit, or that save the most parts; all of them, or those that leave no part far off before a
    refit, which may bring it back, but need not.
    """
    rows = expanded(whole.leaves)
    wanted = sorted(wanted, key=lambda one: -len(one.replaced))[:_TRIED]
    threads = samples.threads
    scores = at_once([partial(score, samples, expanded(_leaves(rows, [one]))) for one in wanted], threads)
    costs = score(samples, rows) - np.array(scores)
    saved = np.array([len(one.replaced) for one in wanted])
    likely = costs - settings.alpha * saved <= _UNREFITTED_SCORE_LOSS
    every = np.flatnonzero(likely).tolist()
    cheap = sorted(every, key=lambda i: float(costs[i] - settings.alpha * saved[i]))
    many = sorted(every, key=lambda i: (-int(saved[i]), float(costs[i])))
    looks = [partial(measured, samples, _leaves(rows, [wanted[i]]), settings) for i in cheap]
    alone = dict(zip(cheap, at_once(looks, threads), strict=True))
    near = [i for i, trial in alone.items() if trial.off <= whole.off + _UNREFITTED_OFF]
    worthy = sorted(near, key=lambda i: -alone[i].value)
    seen: list[list[int]] = [[]]
    for order in (worthy, cheap, near, many):
        chosen: list[int] = []
        taken: frozenset[int] = frozenset()
        for i in order:
            if not taken & wanted[i].parts:
                chosen.append(i)
                taken |= wanted[i].parts
        if chosen not in seen:
            seen.append(chosen)
    return [[wanted[i] for i in chosen] for chosen in seen[1:]]


def _leaves(rows: Rows, repeats: Sequence[Repeat]) -> list[RepeatedPart]:
    gone = frozenset[int]().union(*(one.replaced for one in repeats))
    isometries = {base: one.isometries for one in repeats for base in one.bases}
    return [RepeatedPart(row, isometries.get(i, ())) for i, row in enumerate(rows) if i not in gone]
