"""Outlines of gears and racks in a tree of features as a body and one tooth, or one gap, with its copies:
that is how they are drawn, and how they are changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from partwright.approximation.profile_parts import stacked, with_profile
from partwright.approximation.sketches.racks import Rack, racked
from partwright.approximation.sketches.rims import SHARP
from partwright.approximation.sketches.sections import FINE
from partwright.approximation.sketches.teeth import Teeth, toothed
from partwright.assembly import Similarity
from partwright.fields import Extrusion, Profile
from partwright.superfrusta.feature_steps import Feature, FeatureTree, covers

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_NEAR = 2 * FINE  # unit lengths, by which what stands on another may be off it
_LOSS = 1e-3  # of R: one tooth is not quite the next


def with_teeth_apart(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree with every outline as a circle and teeth, or with a straight side and a row of fins, where
    these have less than half of its corners and the tree is about as near: that they are two features does
    not count, as both say more than one did."""
    least = search.scored(tree).score - _LOSS
    while True:
        others = [search.scored(replace(tree, features=features)) for features in _rewritten(search, tree)]
        near = [other for other in others if other.score >= least]
        if not near:
            return tree
        tree = min(near, key=lambda one: (_corners(one), -one.score))


def _corners(tree: FeatureTree) -> int:
    return sum(feature.sides for feature in tree.features)


def _rewritten(search: FeatureSearch, tree: FeatureTree) -> Iterator[list[Feature]]:
    for i, feature in enumerate(tree.features):
        field = feature.part.field
        if (
            feature.freeform
            or not isinstance(field, Extrusion)
            or field.taper
            or field.rims != (SHARP, SHARP)
        ):
            continue
        ways: Iterator[Teeth | Rack] = chain(toothed(field.profile), racked(field.profile))
        for teeth in ways:
            base, tooth = _steps(search, feature, teeth)
            if 2 * (base.sides + tooth.sides) >= len(field.profile.corners):
                continue
            before, after = tree.features[:i], tree.features[i + 1 :]
            if teeth.added or i == 0:  # what is cut from it would be cut from what is there before
                yield [*before, base, tooth, *after]
            if teeth.added and i:  # it may stand on another
                yield [*before, tooth, *after]
            if not teeth.added:  # an engraved scale: gaps in the end of another
                for j, other in enumerate(tree.features):
                    whole = _stacked(search, other, base) if j != i else None
                    if whole is not None:
                        rest = {k: [one] for k, one in enumerate(tree.features)}
                        rest |= {max(i, j): [], min(i, j): [whole]}
                        rest[i] = [*rest[i], tooth]
                        yield [one for k in sorted(rest) for one in rest[k]]


def _stacked(search: FeatureSearch, one: Feature, other: Feature) -> Feature | None:
    """Both as one feature, where both are added once and one stands on the other with the same profile."""
    alone = all(f.added and f.image is None and not f.part.instances for f in (one, other))
    part = stacked(one.part, other.part, _NEAR) if alone and not one.freeform else None
    return replace(one, part=part, covers=covers(part, search.points)) if part is not None else None


def _steps(search: FeatureSearch, feature: Feature, teeth: Teeth | Rack) -> tuple[Feature, Feature]:
    """The base, and the teeth."""
    whole = feature.part
    pose = whole.pose
    own = [pose @ move @ pose.inverse() for move in teeth.moves]
    copies = [*own, *(move @ inner for move in whole.instances for inner in (Similarity(), *own))]

    def step(profile: Profile, instances: Sequence[Similarity], added: bool) -> Feature:
        part = replace(with_profile(whole, profile), instances=tuple(instances))
        within = covers(part, search.points)
        return replace(feature, part=part, added=added, covers=within, sides=len(profile.corners))

    base = step(teeth.base, whole.instances, feature.added)
    return base, step(teeth.tooth, copies, teeth.added is feature.added)
