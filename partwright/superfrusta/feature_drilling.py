"""Round holes that no feature has, drilled in the end: each tells by its own walls that it was drawn, however
little it explains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.holes import is_empty, merged_holes, points_within
from partwright.approximation.sketches.round_holes import RoundHole, round_holes
from partwright.metrics.deviation import place_in
from partwright.shapes import Shape, length_text
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

    def is_filled(hole: RoundHole) -> bool:
        points = points_within(hole.part()).astype(np.float32)
        return bool((distance(points) < -_DEEP).mean() > _FILLED)

    return [hole for hole in holes if is_filled(hole)]


def hole_warnings(shape: Shape, holes: Sequence[RoundHole]) -> tuple[str, ...]:
    """One sentence for all that no feature has; none where there are none."""
    if not holes:
        return ()
    wide = float(shape.frame.length_from_unit(2 * max(hole.radius for hole in holes)))
    many = f"{len(holes)} round holes, up to" if len(holes) > 1 else "a round hole,"
    places = list(dict.fromkeys(place_in(shape, hole.middle) for hole in holes))
    more = " and elsewhere" if len(places) > 1 else ""
    it = "them" if len(holes) > 1 else "it"
    size = length_text(wide, shape.unit)
    return (f"left out: {many} {size} wide, at the {places[0]}{more}: no feature has {it}",)


def with_holes_drilled(search: FeatureSearch, tree: FeatureTree, holes: Sequence[RoundHole]) -> FeatureTree:
    """The tree with those of holes cut that it fills, each size once, as many as its features may be.

    They cost nothing where trees are compared: what is known to be there needs no other reason.
    """
    missing = without_feature(holes, tree.distance)
    parts = merged_holes([hole.part() for hole in missing], search.samples.measure)
    parts = parts[: max(0, search.limit - len(tree.features))]
    if not parts:
        return tree
    cuts = [Feature(False, part, covers(part, search.points), _SIDES) for part in parts]
    drilled = replace(tree, features=[*tree.features, *cuts], steps=())
    covered = drilled.at(search.points)
    return replace(drilled, covered=covered, score=search.score_of(covered))
