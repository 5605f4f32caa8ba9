"""Features that no longer pay, when all are there: later ones may have made earlier ones vain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.meshing.manifolds import surface_of
from partwright.superfrusta.feature_mending import FAR
from partwright.superfrusta.feature_steps import Feature, FeatureTree, covers, fold, within_box

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_NEARLY = 0.75  # of `FAR`: beyond edges, the distance of a fold is less than the way to it
_FURTHER = 1e-3  # unit lengths, by which a place that is far off may be further off


def pruned(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree without features that explain less than their price, the vainest first.

    None goes without which its own place is far off that was not before. What is missed and what is
    too much are those of the tree as given.
    """
    if len(tree.features) < 2:
        return tree
    masks = [mask_of(feature, search.points) for feature in tree.features]
    kept = list(range(len(tree.features)))
    needed: set[int] = set()
    score = search.score_of(fold_of_masks(tree, masks, kept))
    while True:
        tried = [i for i in kept[1:] if i not in needed and tree.features[i].sides]
        scores = {i: search.score_of(fold_of_masks(tree, masks, [k for k in kept if k != i])) for i in tried}
        gains = {i: scores[i] - score + search.price(tree.features[i].sides) for i in tried}
        vain = max(gains, key=gains.__getitem__, default=None)
        if vain is None or gains[vain] <= 0:
            break
        left = [k for k in kept if k != vain]
        boxes = [copy.bounds() for part in tree.features[vain].parts for copy in part.copies]
        before, after = (farthest_corner(search, _only(tree, some), boxes) for some in (kept, left))
        if after > max(_NEARLY * FAR, before + _FURTHER):
            needed.add(vain)
            continue
        kept, score = left, scores[vain]
    if len(kept) == len(tree.features):
        return tree
    return replace(search.scored(_only(tree, kept)), off=tree.off)


def farthest_corner(
    search: FeatureSearch, tree: FeatureTree, boxes: Sequence[NDArray[np.float64]] | None = None
) -> float:
    """How far a corner of the fold lies outside of the shape, or one of what it lacks outside of the fold; of
    those in one of the boxes (2, 3) each, if there are any."""
    fold = tree.body()
    outside, missed = (
        _in_boxes(surface_of(body)[0].astype(np.float32), boxes) for body in (fold, search.body - fold)
    )
    sticking = search.samples.measure(outside).max(initial=0.0)
    return float(max(sticking, tree.distance(missed).max(initial=0.0)))


def _in_boxes(
    points: NDArray[np.float32], boxes: Sequence[NDArray[np.float64]] | None
) -> NDArray[np.float32]:
    if boxes is None:
        return points
    within = [within_box(points, low - _FURTHER, high + _FURTHER) for low, high in boxes]
    return points[np.any(within, axis=0)]


def _only(tree: FeatureTree, kept: list[int]) -> FeatureTree:
    return replace(tree, features=[tree.features[k] for k in kept], steps=())


def mask_of(feature: Feature, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie within a feature, its copies and its image."""
    return np.any([covers(part, points) for part in feature.parts], axis=0)


def fold_of_masks(tree: FeatureTree, masks: list[NDArray[np.bool_]], kept: list[int]) -> NDArray[np.bool_]:
    return fold(((tree.features[k].added, masks[k]) for k in kept), len(masks[0]))
