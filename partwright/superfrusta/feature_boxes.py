"""Boxes in a tree of features that are one box together, which is how it is drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.holes import holes_apart
from partwright.approximation.sketches.sections import FINE
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box
from partwright.superfrusta.feature_steps import Feature, FeatureTree

Floats = NDArray[np.float64]

_SAME = 2e-4  # of the samples, that may lie otherwise
_NEAR = 2 * FINE  # unit lengths, by which sides that lie in one plane may be apart
_SQUARE = 1e-4  # of a cosine


def with_whole_boxes(tree: FeatureTree, points: NDArray[np.float32]) -> FeatureTree:
    """The tree with one box for two features, with all their copies, that fill it, where that is the same at
    points (N, 3): the middle of a plate that two rows of fins stand beside, and both its ends."""
    covered = tree.at(points)
    while True:
        found = next((o for o in _rewritten(tree) if float((o.at(points) != covered).mean()) < _SAME), None)
        if found is None:
            return tree
        tree = found


def _rewritten(tree: FeatureTree) -> Iterator[FeatureTree]:
    features = tree.features
    none = np.zeros(0, bool)
    boxes = {i: parts for i, feature in enumerate(features) if (parts := _as_box(feature)) is not None}
    for i, j in combinations(boxes, 2):
        (one, holes), (other, more) = boxes[i], boxes[j]
        box = _filled([*one.copies, *other.copies])
        if box is None:
            continue
        whole = replace(features[i], part=box, covers=none, sides=4)
        result: list[Feature] = []
        for k, feature in enumerate(features):
            if k == i:
                result.append(whole)
                result += [Feature(False, hole, none, 0) for hole in (*holes, *more)]
            elif k != j:
                result.append(feature)
        yield replace(tree, features=result)


def _as_box(feature: Feature) -> tuple[Part, tuple[Part, ...]] | None:
    """The box that a feature is, and the holes in it; None of others."""
    if not feature.added or feature.image is not None or feature.freeform:
        return None
    part, holes = holes_apart(feature.part)
    return (part, holes) if isinstance(part.field, Box) else None


def _filled(boxes: list[Part]) -> Part | None:
    """The box that others fill, in the frame of the first, which all of them share; None where there is
    none."""
    first = boxes[0]
    frame, origin = rotation_matrix(first.rotation), np.array(first.translation)
    ends = []
    for part in boxes:
        turn = np.abs(frame.T @ rotation_matrix(part.rotation))
        if np.abs(turn - turn.round()).max() > _SQUARE:
            return None
        assert isinstance(part.field, Box)
        half = turn.round() @ part.field.size / 2
        middle = frame.T @ (np.array(part.translation) - origin)
        ends.append((middle - half, middle + half))
    low, high = np.min([a for a, _ in ends], axis=0), np.max([b for _, b in ends], axis=0)
    if not _fill(ends, low, high):
        return None
    x, y, z = (origin + frame @ ((low + high) / 2)).tolist()
    width, depth, height = (high - low).tolist()
    return replace(first, field=Box((width, depth, height)), translation=(x, y, z), instances=())


def _fill(ends: list[tuple[Floats, Floats]], low: Floats, high: Floats) -> bool:
    """Whether boxes, of each two opposite corners (3,), lie in a row that is the box from `low` to `high`."""
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        off = [np.abs([a[others] - low[others], b[others] - high[others]]).max() for a, b in ends]
        row = sorted((float(a[axis]), float(b[axis])) for a, b in ends)
        reached = np.maximum.accumulate([end for _, end in row])
        gaps = [start - end for (start, _), end in zip(row[1:], reached[:-1].tolist(), strict=True)]
        if max(off) < _NEAR and max(gaps) < _NEAR:
            return True
    return False
