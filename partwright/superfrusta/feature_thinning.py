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
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import CHORD, Solid, far_places, reach
from partwright.superfrusta.feature_pruning import fold_of_masks, mask_of
from partwright.superfrusta.feature_steps import Feature, FeatureTree, with_open_ends_everywhere

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

SEEN = 0.018
"""Unit lengths: 1 % of the longest side, by which the surface may move where a feature goes."""
_LITTLE = 2.0  # prices of a feature, that what goes explains at most
_AROUND = 2 * SEEN  # unit lengths around a feature that are looked at; others matter twice as far
_FURTHER = 4e-3  # unit lengths, by which what is further off already may be so still more
_TRIES = 5  # times that what is made is looked at


def thinned(search: FeatureSearch, tree: FeatureTree, made: Callable[[FeatureTree], Assembly]) -> FeatureTree:
    """The tree without features that hardly show, those that explain the least first.

    made: as of `with_freeform`. Where what is made of the tree would be further off than it is, features that
    lie there stay, and so do some where it would fall apart. What is missed and what is too much are left as
    they were.
    """
    gone = _vain(search, tree)
    if not gone:
        return tree
    shape = Solid(search.body, search.samples.measure)
    bodies = Solid.of(made(tree)).count
    for _ in range(_TRIES):
        thinner = _without(search, tree, gone)
        result = Solid.of(made(thinner))
        off = [place for place in far_places(shape, result) if place.off > tree.off + _FURTHER]
        if not off and result.count <= bodies:
            return thinner
        kept = {i for place in off for i in gone if reaches(tree.features[i], place.box)}
        kept = kept or {gone[-1]}
        gone = [i for i in gone if i not in kept]
        if not gone:
            break
    return tree


def _vain(search: FeatureSearch, tree: FeatureTree) -> list[int]:
    """Features that explain little and hardly show, in the order in which they go."""
    features = tree.features
    masks = [mask_of(feature, search.points) for feature in features]
    bodies = _Bodies(search, features)
    kept, gone = list(range(len(features))), list[int]()
    needed = {0}

    def loss(index: int) -> float:
        return score - search.score_of(fold_of_masks(tree, masks, [k for k in kept if k != index]))

    while True:
        score = search.score_of(fold_of_masks(tree, masks, kept))
        losses = {i: loss(i) for i in kept if i not in needed}
        least = min(losses, key=losses.__getitem__, default=None)
        if least is None or losses[least] > _LITTLE * search.price(features[least].sides):
            return gone
        left = [k for k in kept if k != least]
        before, after = (bodies.off(some, features[least]) for some in (kept, left))
        if after > max(SEEN, before + _FURTHER):
            needed.add(least)
        else:
            kept = left
            gone.append(least)


def _without(search: FeatureSearch, tree: FeatureTree, gone: Sequence[int]) -> FeatureTree:
    features = [feature for i, feature in enumerate(tree.features) if i not in gone]
    price = tree.price - sum(search.price(tree.features[i].sides) for i in gone)
    thinner = replace(tree, features=features, price=price, steps=())
    covered = thinner.at(search.points)
    return replace(thinner, covered=covered, score=search.score_of(covered))


def reaches(feature: Feature, box: NDArray[np.float64]) -> bool:
    """Whether a feature, or a copy of it, comes near to a box (2, 3)."""
    ends = [copy.bounds() for part in feature.parts for copy in part.copies]
    return any((low - _AROUND < box[1]).all() and (high + _AROUND > box[0]).all() for low, high in ends)


class _Bodies:
    """The features of a tree as bodies, whose folds are held against the shape. Open ends go on outside, as
    in what is made of them: a hole in a round wall that ends flat leaves a skin over its mouth."""

    def __init__(self, search: FeatureSearch, features: Sequence[Feature]) -> None:
        measure = search.samples.measure
        rest = [with_open_ends_everywhere(feature, measure, search.reach) for feature in features[1:]]
        self._search, self._features = search, [*features[:1], *rest]
        self._wholes = [[solid_of(part, CHORD) for part in feature.parts] for feature in self._features]

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
