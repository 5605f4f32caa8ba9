"""Round holes that no feature has, drilled in the end: each tells by its own walls that it was drawn, however
little it explains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.profile_parts import with_profile
from partwright.approximation.sketches.holes import is_empty, merged_holes, points_within
from partwright.approximation.sketches.round_holes import RoundHole, round_holes
from partwright.assembly import Part
from partwright.fields import Extrusion
from partwright.fields.profile import Loop, Profile, circle_of
from partwright.metrics.deviation import places_in
from partwright.shapes import Shape, length_text
from partwright.superfrusta.feature_pruning import mask_of
from partwright.superfrusta.feature_steps import Feature, FeatureTree, covers

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]

_DEEP = 5e-3  # unit lengths within a solid, from which on a point of a hole is filled
_FILLED = 0.3  # of a hole's points, that are filled where it is not there
_SIDES = 2  # of a circle, as it is drawn


def empty_round_holes(shape: Shape) -> list[RoundHole]:
    """Round holes of a shape in which there is nothing of it, in the unit frame."""
    return [hole for hole in round_holes(*shape.unit_mesh) if is_empty(hole.part(), shape.unit_distance)]


def without_feature(holes: Sequence[RoundHole], distance: Distance) -> list[RoundHole]:
    """Those of holes that a solid fills; distance: (N,) of that at points (N, 3), unit lengths."""
    return [hole for hole in holes if _is_filled(hole.part(), distance)]


def _is_filled(hole: Part, distance: Distance, opened: Distance | None = None) -> bool:
    """Whether a solid is where a hole, without its copies, would be; opened: and another is not."""
    points = points_within(hole).astype(np.float32)
    filled = distance(points) < -_DEEP
    if opened is not None:
        filled &= opened(points) > _DEEP
    return bool(filled.mean() > _FILLED)


def hole_warnings(shape: Shape, holes: Sequence[RoundHole]) -> tuple[str, ...]:
    """One sentence for all that no feature has; none where there are none."""
    if not holes:
        return ()
    wide = float(shape.frame.length_from_unit(2 * max(hole.radius for hole in holes)))
    many = f"{len(holes)} round holes, up to" if len(holes) > 1 else "a round hole,"
    places = places_in(shape, (hole.middle for hole in holes))
    it = "them" if len(holes) > 1 else "it"
    size = length_text(wide, shape.unit)
    return (f"left out: {many} {size} wide, at the {places}: no feature has {it}",)


def with_holes_drilled(search: FeatureSearch, tree: FeatureTree, holes: Sequence[RoundHole]) -> FeatureTree:
    """The tree with those of holes cut that it fills, each size once, as many parts as are asked for; round
    holes that some copies of a profile have only in the tree are none of it before.

    They cost nothing where trees are compared: what is known to be there needs no other reason.
    """
    features = [_with_true_holes(search, tree, feature) for feature in tree.features]
    missing = without_feature(holes, FeatureTree(features).distance)
    parts = merged_holes([hole.part() for hole in missing], search.samples.measure)
    parts = parts if search.asked is None else parts[: max(0, search.asked - len(features))]
    if not parts and all(one is other for one, other in zip(features, tree.features, strict=True)):
        return tree
    cuts = [Feature(False, part, covers(part, search.points), _SIDES) for part in parts]
    drilled = replace(tree, features=[*features, *cuts], steps=())
    covered = drilled.at(search.points)
    return replace(drilled, covered=covered, score=search.score_of(covered))


def _with_true_holes(search: FeatureSearch, tree: FeatureTree, feature: Feature) -> Feature:
    """The feature without round holes of its profile that the shape fills in one of its copies, where
    nothing else of the tree does, as a shaft in a ring."""
    field = feature.part.field
    if not feature.added or feature.freeform or not isinstance(field, Extrusion):
        return feature

    def is_true(loop: Loop) -> bool:
        if circle_of(loop) is None:
            return True
        part = replace(with_profile(feature.part, Profile(loop)), instances=feature.part.instances)
        copies = (copy for own in replace(feature, part=part).parts for copy in own.copies)
        return not any(_is_filled(copy, search.samples.measure, tree.distance) for copy in copies)

    kept = tuple(loop for loop in field.profile.holes if is_true(loop))
    if len(kept) == len(field.profile.holes):
        return feature
    profile = Profile(field.profile.outline, kept)
    part = replace(feature.part, field=replace(field, profile=profile))
    filled = replace(feature, part=part)
    return replace(filled, covers=mask_of(filled, search.points))
