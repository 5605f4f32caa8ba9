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
from partwright.superfrusta.feature_blanks import worth
from partwright.superfrusta.feature_copying import replayed
from partwright.superfrusta.feature_mending import mended
from partwright.superfrusta.feature_steps import FeatureTree, Step

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_ROUNDS = 3
_CARVED = 0.1  # of the samples in the first body: a cut that takes as many carves it, a hole does not


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


def rebased(search: FeatureSearch, tree: FeatureTree, own: Sequence[Candidate]) -> FeatureTree:
    """The tree, or one of no more steps that is worth more, begins with another body and goes on without the
    cuts that carve the first. own: candidates of the whole."""
    carving = _carving(tree.steps)
    if not carving or not _is_once(tree.steps[0]):
        return tree
    rest = [step for k, step in enumerate(tree.steps) if k not in carving]
    steps = _with_other(search, rest, 0, own)
    if steps[0].chosen.key == rest[0].chosen.key:
        return tree
    other = mended(search, search.grown(replayed(search, steps), own, None, most=len(tree.steps)))
    by_chance = search.tie if other.price >= tree.price else 0.0  # what is plainer need be no better
    return other if worth(other) > worth(tree) + by_chance else tree


def _carving(steps: Sequence[Step]) -> set[int]:
    """The cuts that take much of what a tree begins with."""

    def taken(k: int) -> float:
        return float((steps[0].within & steps[k - 1].covered & ~steps[k].covered).sum())

    least = _CARVED * float(steps[0].within.sum()) if steps else 0.0
    return {k for k in range(1, len(steps)) if not steps[k].added and taken(k) >= least}


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
