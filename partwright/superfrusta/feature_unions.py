"""Extrusions side by side in a tree of features as one of their common outline, which is how they are drawn:
two plates that make an angle, a slot and the pocket beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, OpType
from numpy.typing import NDArray

from partwright.approximation.profile_parts import drawn_profile, extruded_part
from partwright.approximation.sketches.sections import FINE, profile_of
from partwright.approximation.sketches.teeth import drawn_corners
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Extrusion
from partwright.fields.profile import Profile
from partwright.superfrusta.feature_pruning import farthest_corner, fold_of_masks, mask_of
from partwright.superfrusta.feature_steps import Feature, FeatureTree

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

Floats = NDArray[np.float64]
Masks = list[NDArray[np.bool_]]
Joined = Callable[[Feature, Feature], Iterator[Feature]]
"""Of two features, both added or both cut: what may stand for both."""

_CHORD = 1e-4  # unit lengths: how far chords of an outline may be off
_NEAR = 2 * FINE  # unit lengths, by which walls that are one may be apart
_PARALLEL = 1e-6  # of a cosine
_FULL = 0.5  # of the common extrusion, that the two fill at least: others may fill the rest
_PAIR = 2  # copies of a feature that go into one outline: more are a pattern, which is drawn once
_LOSS = 3e-4  # of R, that common outlines may cost, all together
_FURTHER = 1e-3  # unit lengths, by which a corner may be further off


def with_common_outlines(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree with one extrusion for two features, with all their copies, where that is plainer, explains
    the shape no worse, and is no further off."""
    return with_plainest(search, tree, _common, _LOSS)


def with_plainest(search: FeatureSearch, tree: FeatureTree, joined: Joined, loss: float) -> FeatureTree:
    """The tree with one feature for two, the plainest first, where that is plainer, explains the shape no
    worse, and is no further off. loss: of R, that all such may cost together."""
    tree = search.scored(tree)
    least, limit = tree.score - loss, -1.0
    while True:
        plainer = [
            other
            for other in _rewritten(search, tree, joined)
            if other.score >= least and other.objective > tree.objective
        ]
        if plainer and limit < 0:  # as much time as all else here
            limit = farthest_corner(search, tree) + _FURTHER
        best_first = sorted(plainer, key=lambda other: -other.objective)
        found = next((other for other in best_first if farthest_corner(search, other) <= limit), None)
        if found is None:
            return tree
        tree = found


def _rewritten(search: FeatureSearch, tree: FeatureTree, joined: Joined) -> Iterator[FeatureTree]:
    """With one feature in the place of either of two."""
    features = tree.features
    masks = [mask_of(feature, search.points) for feature in features]
    for i, j in combinations(range(len(features)), 2):
        if features[i].added is features[j].added:
            for whole in joined(features[i], features[j]):
                whole = replace(whole, covers=mask_of(whole, search.points))
                yield from (_with(search, tree, masks, whole, *places) for places in ((i, j), (j, i)))


def _with(
    search: FeatureSearch, tree: FeatureTree, masks: Masks, whole: Feature, place: int, gone: int
) -> FeatureTree:
    """masks: (N,) each, the samples within each feature."""
    kept = [k for k in range(len(masks)) if k != gone]
    features = [whole if k == place else tree.features[k] for k in kept]
    own = [whole.covers if k == place else masks[k] for k in kept]
    other = replace(tree, features=features, steps=())
    covered = fold_of_masks(other, own, list(range(len(kept))))
    price = sum(search.price(feature.sides) for feature in features)
    return replace(other, covered=covered, score=search.score_of(covered), price=price)


def _common(one: Feature, other: Feature) -> Iterator[Feature]:
    """Both as one extrusion: the first copies, where there are as many more of each, and all copies."""
    if one.freeform or other.freeform:
        return
    copies, others = ([copy for part in f.parts for copy in part.copies] for f in (one, other))
    middle = copies[0].bounds().mean(axis=0)
    nearest = min(others, key=lambda copy: float(np.linalg.norm(copy.bounds().mean(axis=0) - middle)))
    for frame in _frames(one.part):
        if len(copies) == len(others) > 1 and (one.image is None) is (other.image is None):
            for part, sides in _extruded([copies[0], nearest], frame):
                yield replace(one, part=replace(part, instances=one.part.instances), sides=sides)
        if max(len(copies), len(others)) <= _PAIR:
            for part, sides in _extruded([*copies, *others], frame):
                yield replace(one, part=part, image=None, sides=sides)


def _frames(part: Part) -> Iterator[Floats]:
    """(3, 3) local to world, along whose third column a part may be extruded."""
    frame = rotation_matrix(part.rotation)
    for k in range(3) if isinstance(part.field, Box) else (2,):
        yield frame[:, _turned(k)]


def _turned(k: int) -> list[int]:
    """The axes in order, so that the last is axis k."""
    return [(k + 1) % 3, (k + 2) % 3, k]


def _extruded(parts: Sequence[Part], frame: Floats) -> Iterator[tuple[Part, int]]:
    """What is extruded of the outline of all, from the lowest to the highest end, and its sides; nothing
    where they are no extrusions in a frame, lie apart, or fill too little of it."""
    seen = [_seen(part, frame) for part in parts]
    prisms = [prism for prism in seen if prism is not None]
    if len(prisms) < len(seen):
        return
    low, high = min(prism.low for prism in prisms), max(prism.high for prism in prisms)
    section = CrossSection.batch_boolean([prism.section for prism in prisms], OpType.Add)
    if sum(prism.volume for prism in prisms) < _FULL * section.area() * (high - low):
        return
    if len(section.decompose()) > 1:
        section = section.offset(_NEAR, JoinType.Miter).offset(-_NEAR, JoinType.Miter)
    profile = profile_of(section) if len(section.decompose()) == 1 else None
    try:
        if profile is not None:
            yield extruded_part(profile, frame, low, high), drawn_corners(profile.loops)
    except ParameterError:  # too thin for a solid
        return


@dataclass(frozen=True)
class _Prism:
    """A part as it is seen in a frame: its section, and from where to where along the third column."""

    section: CrossSection
    low: float
    high: float

    @property
    def volume(self) -> float:
        return float(self.section.area() * (self.high - self.low))


def _seen(part: Part, frame: Floats) -> _Prism | None:
    """None of what is not extruded along the frame's third column, without taper and rims."""
    field, turn = part.field, frame.T @ rotation_matrix(part.rotation)
    drawn: tuple[Profile, float] | None
    if isinstance(field, Box):
        order = _turned(int(np.abs(turn[2]).argmax()))
        x, y, height = (field.size[k] for k in order)
        turn, drawn = turn[:, order], (Profile.rectangle(x, y), height)
    elif isinstance(field, Extrusion) and field.has_rims:
        return None
    else:
        drawn = drawn_profile(field)
    if drawn is None or abs(turn[2, 2]) < 1 - _PARALLEL:
        return None
    profile, height = drawn
    x, y, z = (frame.T @ np.array(part.translation)).tolist()
    lines = [line @ turn[:2, :2].T + (x, y) for line in profile.polylines(_CHORD)]
    return _Prism(CrossSection(lines, FillRule.EvenOdd), z - height / 2, z + height / 2)
