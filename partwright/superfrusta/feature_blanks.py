"""Trees that are cut from a blank, the silhouette of the whole from end to end: it is worth less at first
than a section that the shape has, and in the end often more."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import silhouettes
from partwright.superfrusta.feature_steps import FeatureTree

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

BEHIND = 0.03
"""Of the objective, by which a tree is well behind another."""
PERFECT = 0.985
"""R from which on a tree can hardly become better, but plainer."""
_ENDED = 0.015  # of the objective, that a tree may gain where it is ended
_FEW, _CHEAP = 1, 2.2  # features, and prices of plain ones, of which none is left to save
_BLANKS, _PLAIN = 2, 4.0  # and prices of plain ones, with which but one is tried
_UNDRAWN = 5.0  # prices of plain features, that each further piece of freeform has to save
_PATIENT = 6  # steps after which a tree may be well behind, and no more than the best has, but for one


def cut_from_blanks(
    search: FeatureSearch,
    best: FeatureTree,
    others: Sequence[Candidate],
    tried: Collection[tuple[float, ...]],
) -> FeatureTree:
    """The best tree, or one that is cut from a silhouette, no further off, and worth more when both are
    mended, by more where it has more freeform. others: candidates of the whole. tried: keys of those that a
    tree has begun with."""
    if len(best.features) <= _FEW or best.price <= _CHEAP * search.alpha:
        return best
    blanks = [blank for blank in silhouettes(search.body, search.frames) if blank.key not in tried]
    gains = search.gains(search.empty, blanks, True) if blanks else np.zeros(0)
    found, whole, highest = best, None, -math.inf
    seen = [best]
    most = len(best.steps) if best.score > PERFECT else None
    patient = min(_PATIENT, len(best.steps) + 1)
    for index in np.argsort(-gains)[: _BLANKS if best.price > _PLAIN * search.alpha else 1]:
        start = search.extended(search.empty, blanks[index], True)
        tree = search.grown(start, others, best, patient=patient, most=most)
        hopeless = tree.objective < max(best.objective, highest) - _ENDED
        if hopeless or any(_are_same(tree, other) for other in seen):
            continue
        seen.append(tree)
        tree = search.ended(tree, others)
        if tree.off > best.off:
            continue  # skins where a cut runs along the blank's own walls, say, which freeform does not mend
        whole = search.mend(best) if whole is None else whole
        if tree.objective > max(_least(search, tree, whole), highest):
            highest = tree.objective
            rival = search.mend(tree)
            more = max(0, _freeform(rival) - _freeform(whole))
            if worth(rival) > _least(search, rival, whole) + _UNDRAWN * more * search.alpha:
                found, whole = tree, rival
    return found


def _are_same(tree: FeatureTree, other: FeatureTree) -> bool:
    """Whether two trees have the same steps, in whatever order: better bodies stand in place of a blank."""
    one, two = (sorted(step.chosen.key for step in some.steps) for some in (tree, other))
    return one == two


def _least(search: FeatureSearch, tree: FeatureTree, whole: FeatureTree) -> float:
    """What a tree has to be worth to be taken instead: of what is as good, the plainest is, if it has no more
    copies."""
    plainer = tree.price < whole.price and _copies(tree) <= _copies(whole)
    return worth(whole) + (0.0 if plainer else search.tie)


def _copies(tree: FeatureTree) -> int:
    return sum(len(part.copies) for feature in tree.features for part in feature.parts)


def worth(tree: FeatureTree) -> float:
    """R less the price, and less what is far off."""
    return tree.objective - tree.off


def _freeform(tree: FeatureTree) -> int:
    """Pieces that no feature explains: a blank that leaves more of them is hardly one that was drawn."""
    return sum(feature.freeform for feature in tree.features)
