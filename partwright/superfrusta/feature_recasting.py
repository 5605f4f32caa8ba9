"""Features of a grown tree that are sought anew: what paid most at first may be what much had to be cut from.

A step of the search takes what explains most by itself. An outline around three shafts does, and then
eight cuts make the shafts of it. So a feature goes, with all that came after it in its place, and the search
goes on from what is left, without that one candidate at first. What it finds is kept where it is worth more.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.candidate import Candidate
from partwright.superfrusta.feature_copying import replayed
from partwright.superfrusta.feature_steps import FeatureTree, Step

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_TRIES = 8
_WITHIN = 0.9  # of a box, that another holds
_CUT = 0.7  # of the samples that a cut takes away, that are a body's


def recast(search: FeatureSearch, tree: FeatureTree, own: Sequence[Candidate]) -> FeatureTree:
    """The tree, or one of no more features that is worth more. own: candidates of the whole."""
    tried: set[tuple[float, ...]] = set()
    for _ in range(_TRIES):
        groups = [(k, group) for k, group in _groups(tree.steps) if tree.steps[k].chosen.key not in tried]
        if not groups:
            break
        k, group = max(groups, key=lambda one: len(one[1]))
        banned = tree.steps[k].chosen.key
        tried.add(banned)
        rest = replayed(search, [step for j, step in enumerate(tree.steps) if j not in group])
        other = _grown_without(search, rest, own, banned, len(tree.steps))
        if other.objective > tree.objective + search.tie:
            tree = other
    return tree


def _grown_without(
    search: FeatureSearch,
    tree: FeatureTree,
    own: Sequence[Candidate],
    banned: tuple[float, ...],
    most: int,
) -> FeatureTree:
    """Until nothing pays, or there are as many steps as are allowed; the first is not what is banned."""
    step = search.step(tree, own, banned=banned)
    while step is not None:
        tree = step
        step = search.step(tree, own) if len(tree.steps) < most else None
    return tree


def _groups(steps: Sequence[Step]) -> Iterator[tuple[int, set[int]]]:
    """Steps but the first, each with the later ones that lie within its box or are cut from it mostly; only
    those that have some."""
    boxes = [np.array([copy.bounds() for copy in step.part.copies]) for step in steps]
    for k in range(1, len(steps)):
        later = {
            j
            for j in range(k + 1, len(steps))
            if _lie_within(boxes[j], boxes[k]) or _is_cut_from(steps[j], steps[j - 1], steps[k])
        }
        if later:
            yield k, {k, *later}


def _is_cut_from(cut: Step, before: Step, body: Step) -> bool:
    gone = before.covered & ~cut.covered
    return not cut.added and float((gone & body.within).sum()) > _CUT * float(gone.sum())


def _lie_within(boxes: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """Whether most of each box (n, 2, 3) lies within one of the others (m, 2, 3)."""
    low = np.maximum(boxes[:, None, 0], others[None, :, 0])
    high = np.minimum(boxes[:, None, 1], others[None, :, 1])
    shared = np.prod(np.maximum(high - low, 0.0), axis=-1).max(axis=1)
    return bool((shared > _WITHIN * np.prod(boxes[:, 1] - boxes[:, 0], axis=-1)).all())
