"""Features that nobody would miss: when a tree is mended, what explains little goes where the surface hardly
moves without it.

A price alone cannot tell: a collar that is low explains as little as a chip that is deep and narrow. So how
far the surfaces are apart around a feature is measured, both ways, with it and without.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold

from partwright.assembly import Assembly
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import Solid, far_places, reach
from partwright.superfrusta.feature_pruning import fold_of_masks, mask_of
from partwright.superfrusta.feature_steps import Feature, FeatureTree

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

SEEN = 0.018
"""Unit lengths: 1 % of the longest side, by which the surface may move where a feature goes."""
_LITTLE = 2.0  # prices of a feature, that what goes explains at most
_AROUND = 2 * SEEN  # unit lengths around a feature that are looked at; others matter twice as far
_FURTHER = 4e-3  # unit lengths, by which what is further off already may be so still more
_CHORD = 1e-3  # unit lengths


def thinned(search: FeatureSearch, tree: FeatureTree, made: Callable[[FeatureTree], Assembly]) -> FeatureTree:
    """The tree without features that hardly show, those that explain the least first; itself where what is
    made of it would then be far off, or fall apart.

    made: as of `with_freeform`. What is missed and what is too much are left as they were.
    """
    features = tree.features
    masks = [mask_of(feature, search.points) for feature in features]
    bodies = _Bodies(search, features)
    kept = list(range(len(features)))
    needed = {0}

    def loss(index: int) -> float:
        return score - search.score_of(fold_of_masks(tree, masks, [k for k in kept if k != index]))

    while True:
        score = search.score_of(fold_of_masks(tree, masks, kept))
        losses = {i: loss(i) for i in kept if i not in needed}
        least = min(losses, key=losses.__getitem__, default=None)
        if least is None or losses[least] > _LITTLE * search.price(features[least].sides):
            break
        left = [k for k in kept if k != least]
        before, after = (bodies.off(some, features[least]) for some in (kept, left))
        if after > max(SEEN, before + _FURTHER):
            needed.add(least)
        else:
            kept = left
    if len(kept) == len(features):
        return tree
    gone = sum(search.price(features[k].sides) for k in range(len(features)) if k not in kept)
    thinner = replace(
        tree,
        features=[features[k] for k in kept],
        covered=fold_of_masks(tree, masks, kept),
        score=score,
        price=tree.price - gone,
        steps=(),
    )
    shape = Solid(search.body, search.samples.measure)
    given, result = (Solid(solid_of(whole, _CHORD), whole.distance) for whole in map(made, (tree, thinner)))
    off = max((place.off for place in far_places(shape, result)), default=0.0)
    return thinner if off <= tree.off + _FURTHER and result.count <= given.count else tree


class _Bodies:
    """The features of a tree as bodies, whose folds are held against the shape."""

    def __init__(self, search: FeatureSearch, features: Sequence[Feature]) -> None:
        self._search, self._features = search, features
        self._wholes = [[solid_of(part, _CHORD) for part in feature.parts] for feature in features]

    def off(self, kept: Sequence[int], around: Feature) -> float:
        """How far the fold of those kept and the shape are apart around a feature, unit lengths; 0 where that
        is less than `SEEN`."""
        ends = np.array([copy.bounds() for part in around.parts for copy in part.copies])
        box = np.stack([ends[:, 0].min(axis=0) - _AROUND, ends[:, 1].max(axis=0) + _AROUND])
        near = Manifold.cube((np.ptp(box, axis=0) + 2 * _AROUND).tolist()).translate(
            (box[0] - _AROUND).tolist()
        )
        fold = Manifold()
        for k in kept:
            for whole in self._wholes[k]:
                local = whole ^ near
                fold = fold + local if self._features[k].added else fold - local
        tree = FeatureTree([self._features[k] for k in kept])
        shape = Solid(self._search.body ^ near, self._search.samples.measure)
        return reach(shape, Solid(fold, tree.distance), box, SEEN)
