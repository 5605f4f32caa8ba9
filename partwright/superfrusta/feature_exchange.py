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
        value, steps = max(rivals, key=lambda rival: rival[0])
        if value <= _objective(search, tree.steps) + search.tie:
            break
        other = replayed(search, steps)
        if other.objective <= tree.objective + search.tie:
            break
        tree = other
    return tree


def _is_once(step: Step) -> bool:
    return not step.part.instances and step.image is None


def _with_other(search: FeatureSearch, steps: Sequence[Step], k: int, own: Sequence[Candidate]) -> list[Step]:
    """The steps with the candidate that explains most in the place of one."""
    before, after = steps[:k], steps[k + 1 :]
    pool = [one for one in own if one.key != steps[k].chosen.key and (k == 0 or not one.cuts)]
    if not pool:
        return list(steps)
    left = FeatureTree(covered=_fold(search, [*before, *after]))
    taken = np.logical_or.reduce([np.zeros(len(search.inside), bool), *(step.within for step in after)])
    chosen = pool[int(search.gains(left, pool, True, ~taken).argmax())]
    within, opened = search.mask(chosen) > 0, search.opened(chosen)
    other = replace(steps[k], chosen=chosen, part=chosen.part, within=within, opened=opened)
    return [*before, other, *after]


def _paying(search: FeatureSearch, steps: list[Step]) -> tuple[float, list[Step]]:
    """The steps without those but the first that no longer pay, the vainest first; and their objective."""
    value = _objective(search, steps)
    while len(steps) > 1:
        fewer = ([*steps[:k], *steps[k + 1 :]] for k in range(1, len(steps)))
        best, rest = max(((_objective(search, rest), rest) for rest in fewer), key=lambda one: one[0])
        if best <= value:
            break
        value, steps = best, rest
    return value, steps


def _objective(search: FeatureSearch, steps: Sequence[Step]) -> float:
    price = sum(search.price(step.chosen.sides) for step in steps)
    return search.score_of(_fold(search, steps)) - price


def _fold(search: FeatureSearch, steps: Sequence[Step]) -> NDArray[np.bool_]:
    return FeatureTree(steps=tuple(steps)).behind(np.zeros(len(search.inside), bool))
