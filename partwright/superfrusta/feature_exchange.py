"""Bodies of a grown tree that others would stand for better, now that the rest is there.

A step of the search takes what explains most by itself: a disc about as wide as a hexagonal head, before
the head is there, or a rod as far as it goes on in another. Each body that is there once is held against all
other candidates of the whole, with everything before and after it as it is; what then explains nothing goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.candidate import Candidate
from partwright.superfrusta.feature_copying import replayed
from partwright.superfrusta.feature_steps import FeatureTree, Step

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_ROUNDS = 3


def exchanged(search: FeatureSearch, tree: FeatureTree, own: Sequence[Candidate]) -> FeatureTree:
    """The tree, or one of no more features that is worth more. own: candidates of the whole."""
    for _ in range(_ROUNDS):
        places = [k for k, step in enumerate(tree.steps) if step.added and _is_once(step)]
        if len(tree.steps) < 2 or not places:
            break
        rivals = [_paying(search, _with_other(search, tree.steps, k, own)) for k in places]
        best = max(rivals, key=lambda steps: _objective(search, steps))
        if _objective(search, best) <= _objective(search, tree.steps) + search.tie:
            break
        other = replayed(search, best)
        if other.objective <= tree.objective + search.tie:
            break
        tree = other
    return tree


def _is_once(step: Step) -> bool:
    return not step.part.instances and step.image is None


def _with_other(search: FeatureSearch, steps: Sequence[Step], k: int, own: Sequence[Candidate]) -> list[Step]:
    """The steps with the candidate that explains most in the place of one."""
    rest = [*steps[:k], *steps[k + 1 :]]
    taken = np.zeros(len(search.inside), bool)
    for step in steps[k + 1 :]:
        taken |= step.within
    pool = [one for one in own if one.key != steps[k].chosen.key and (k == 0 or not one.cuts)]
    if not pool:
        return list(steps)
    gains = search.gains(FeatureTree(covered=_fold(rest, len(search.inside))), pool, True, ~taken)
    chosen = pool[int(gains.argmax())]
    within = search.mask(chosen) > 0
    return [*steps[:k], replace(steps[k], chosen=chosen, part=chosen.part, within=within), *steps[k + 1 :]]


def _paying(search: FeatureSearch, steps: list[Step]) -> list[Step]:
    """The steps without those but the first that no longer pay, the vainest first."""
    while len(steps) > 1:
        fewer = [[*steps[:k], *steps[k + 1 :]] for k in range(1, len(steps))]
        best = max(fewer, key=lambda rest: _objective(search, rest))
        if _objective(search, best) <= _objective(search, steps):
            break
        steps = best
    return steps


def _objective(search: FeatureSearch, steps: Sequence[Step]) -> float:
    price = sum(search.price(step.chosen.sides) for step in steps)
    return search.score_of(_fold(steps, len(search.inside))) - price


def _fold(steps: Sequence[Step], count: int) -> NDArray[np.bool_]:
    covered = np.zeros(count, bool)
    for step in steps:
        covered = covered | step.within if step.added else covered & ~step.within
    return covered
