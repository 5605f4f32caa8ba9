"""Walls and openings with floors in a tree of features as solids with pockets, as they are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.pockets import as_pockets, closed_by
from partwright.superfrusta.feature_steps import Feature, FeatureTree

_SAME = 2e-4  # of the samples, that may lie otherwise


def with_pockets(tree: FeatureTree, points: NDArray[np.float32]) -> FeatureTree:
    """The tree with every wall whose holes another part closes, and every cut of which another part fills one
    end, as a solid with pockets, where that is the same at points (N, 3)."""
    covered = tree.at(points)
    while True:
        same = (t for t in _rewritten(tree) if float((t.at(points) != covered).mean()) < _SAME)
        found = next(same, None)
        if found is None:
            return tree
        tree = found


def _rewritten(tree: FeatureTree) -> Iterator[FeatureTree]:
    features = tree.features
    added = [i for i, feature in enumerate(features) if feature.added and feature.image is None]
    for i, j in permutations(added, 2):
        yield from _with_holes_closed(tree, i, j)
    for i, j in combinations(range(len(features)), 2):
        if features[j].added and not (features[i].added or features[i].image or features[j].image):
            for cut in closed_by(features[i].part, features[j].part):
                pocket = replace(features[i], part=cut, covers=np.zeros(0, bool))
                rest = [pocket if k == i else f for k, f in enumerate(features) if k != j]
                yield FeatureTree(rest, score=tree.score, price=tree.price, off=tree.off)


def _with_holes_closed(tree: FeatureTree, wall: int, floor: int) -> Iterator[FeatureTree]:
    features = tree.features
    none = np.zeros(0, bool)
    for body, pockets, holes in as_pockets(features[wall].part, features[floor].part):
        result: list[Feature] = []
        for k, feature in enumerate(features):
            if k == wall:
                result.append(Feature(True, body, none, feature.sides))
                result += [Feature(False, pocket, none, 0) for pocket in pockets]
            if k == max(wall, floor):  # behind the body, which would fill them
                result += [Feature(False, hole, none, 0) for hole in holes]
            if k not in (wall, floor):
                result.append(feature)
        yield FeatureTree(result, score=tree.score, price=tree.price, off=tree.off)
