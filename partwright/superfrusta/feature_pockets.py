"""Walls with floors in a tree of features as solids with pockets, which is how they are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.pockets import as_pockets
from partwright.superfrusta.feature_steps import Feature, FeatureTree

_SAME = 2e-4  # of the samples, that may lie otherwise


def with_pockets(tree: FeatureTree, points: NDArray[np.float32]) -> FeatureTree:
    """The tree with every wall whose holes another part closes as a solid with pockets, where that is the
    same at points (N, 3)."""
    covered = tree.at(points)
    changed = True
    while changed:
        changed = False
        added = [i for i, feature in enumerate(tree.features) if feature.added and feature.image is None]
        for i, j in permutations(added, 2):
            same = (t for t in _rewritten(tree, i, j) if float((t.at(points) != covered).mean()) < _SAME)
            found = next(same, None)
            if found is not None:
                tree, changed = found, True
                break
    return tree


def _rewritten(tree: FeatureTree, wall: int, floor: int) -> Iterator[FeatureTree]:
    features = tree.features
    none = np.zeros(0, bool)
    for body, pockets, holes in as_pockets(features[wall].part, features[floor].part):
        result: list[Feature] = []
        for k, feature in enumerate(features):
            if k == wall:
                result.append(Feature(True, body, none, feature.sides))
                result += [Feature(False, pocket, none, 0) for pocket in pockets]
            elif k == floor:
                result += [Feature(False, hole, none, 0) for hole in holes]
            else:
                result.append(feature)
        yield FeatureTree(result, score=tree.score, price=tree.price, off=tree.off)
