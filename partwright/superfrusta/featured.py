"""A fit of solids that begins with features read off the surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from partwright.approximation.part_roles import FREEFORM
from partwright.approximation.sketches.round_holes import RoundHole
from partwright.assembly import Assembly
from partwright.errors import CancelledError
from partwright.meshing import has_exact_mesh
from partwright.methods import Checkpoint, FitRequest, Progress
from partwright.metrics.deviation import place_in
from partwright.shapes import Shape
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_boxes import with_whole_boxes
from partwright.superfrusta.feature_chips import without_chips
from partwright.superfrusta.feature_drilling import with_holes_drilled, without_feature
from partwright.superfrusta.feature_freeform import far_off, most_explained, with_freeform
from partwright.superfrusta.feature_mouths import LeftOut, mouths_left_out
from partwright.superfrusta.feature_outlines import with_plain_outlines
from partwright.superfrusta.feature_pockets import with_pockets
from partwright.superfrusta.feature_pruning import pruned
from partwright.superfrusta.feature_repeats import with_repeats
from partwright.superfrusta.feature_rings import with_shared_bores
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.feature_teeth import with_teeth_apart
from partwright.superfrusta.feature_thinning import thinned
from partwright.superfrusta.feature_unions import with_common_outlines
from partwright.superfrusta.flat_tree import flattened
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings

_SHARE = 0.3  # of a fit's work that features are at most
_HALFWAY = 10  # steps after which half of that is done
SURE = 0.95
"""R from which on a tree of features is the result, and no other is looked for."""


def wants_features(request: FitRequest[Settings]) -> bool:
    """Whether the fit may begin with features: from nothing, with cuts, and not down to every size."""
    settings = request.settings
    allowed = getattr(settings, "profiles", False) and settings.subtract and not settings.curve
    return bool(allowed and request.start is None)


@dataclass(frozen=True)
class MendedSolids:
    """Solids that were found by the search. off: how far they are off where that is far, unit lengths; else
    0. score: R, 0 where it is not known."""

    assembly: Assembly
    off: float
    score: float


class FeaturedFit:
    """The features of one shape: their search, what it found mended, and the assembly of it."""

    def __init__(self, request: FitRequest[Settings], samples: FitSamples, checkpoint: Checkpoint) -> None:
        self._request, self._samples, self._checkpoint = request, samples, checkpoint
        self._seen: list[FeatureTree] = []
        self._assemblies = FeatureAssembly(request.shape)
        self._freeform: dict[int, tuple[FeatureTree, FeatureTree]] = {}

    def assembly(self, tree: FeatureTree) -> Assembly:
        return self._assemblies.named(tree)

    def tree(self) -> tuple[FeatureTree | None, bool]:
        """The best tree of features within the part budget, and whether it was interrupted; none where the
        surface has no sections, or where it misses the IoU that is asked for.

        Raises:
            CancelledError: cancelled before there was a feature.
        """
        settings, search = self._request.settings, self._search
        try:
            tree = search.run()
            if tree is not None and settings.min_iou is None:
                tree = pruned(search, tree)
            if tree is not None:
                self._seen.append(tree)
                self._report(tree, _SHARE)
            self._checkpoint()
        except CancelledError:
            if not self._seen:
                raise
            return self._seen[-1], True
        if tree is None:
            return None, False
        if settings.min_iou is None:
            points = self._samples.points
            tree = with_pockets(with_shared_bores(tree, points), points)
            toothed = with_teeth_apart(search, tree)
            united = with_common_outlines(search, with_whole_boxes(toothed, points))
            return with_repeats(search, with_plain_outlines(search, united)), False
        for count in range(1, len(tree.features) + 1):
            shorter = tree.first(count)
            if volume_iou(shorter, self._samples) >= settings.min_iou:
                return search.scored(shorter), False
        return None, False

    def mended(self, tree: FeatureTree) -> FeatureTree:
        """The tree with freeform where it is far off, without what then hardly shows, and with round holes
        that it lacks; the one that comes as near as an IoU that is asked for as it is."""
        if self._request.settings.min_iou is not None:
            return tree
        return self._finished(tree)

    def mended_assembly(self, whole: Assembly) -> MendedSolids:
        """Solids that were found by the search, with freeform where they are far off, or only made anew of
        the same parts where these are not: cuts then belong to what they meet, and leave no chip of others.
        Themselves where nothing is off or nothing helps."""
        search, own = self._search, self._own(whole)
        if own is None:
            return MendedSolids(whole, 0.0, 0.0)
        tree = search.scored(_tree_of(own))
        better = self._finished(tree)
        same = [f.part for f in better.features] == [f.part for f in tree.features]
        off = far_off(search, own) if same else math.inf
        if off > better.off:
            return MendedSolids(self.assembly(better), better.off, better.score)
        return MendedSolids(whole, off, tree.score)

    def may_explain(self, whole: Assembly, least: float) -> bool:
        """Whether solids that were found by the search, mended, may explain as much: an R of `least`."""
        search, own = self._search, self._own(whole)
        return own is not None and most_explained(search, own, _tree_of(own).at(search.points)) >= least

    def _own(self, whole: Assembly) -> Assembly | None:
        """Solids that were found by the search in the unit frame; None where they cannot be mended."""
        search = self._search
        if not has_exact_mesh(whole) or search.body.is_empty() or search.volume <= 0:
            return None
        return in_unit_frame(self._request.shape, whole)

    @cached_property
    def _search(self) -> FeatureSearch:
        settings = self._request.settings
        return FeatureSearch(
            self._request.shape,
            self._samples,
            settings.alpha,
            self._checkpoint,
            settings.max_parts,
            self._told,
            self._with_freeform if settings.min_iou is None else None,
        )

    def _with_freeform(self, tree: FeatureTree) -> FeatureTree:
        if id(tree) not in self._freeform:
            most = self._request.settings.max_parts
            made = with_freeform(self._search, tree, self._assemblies.in_unit_frame, most)
            self._freeform[id(tree)] = tree, made
        return self._freeform[id(tree)][1]

    def _finished(self, tree: FeatureTree) -> FeatureTree:
        made = self._assemblies.in_unit_frame
        thin = thinned(self._search, self._with_freeform(tree), made)
        drilled = with_holes_drilled(self._search, thin, self._assemblies.round_holes)
        return without_chips(self._search, drilled, made)

    def holes_left_out(self, own: Assembly) -> list[RoundHole]:
        """Round holes of the shape that an assembly in the unit frame fills."""
        return without_feature(self._assemblies.round_holes, own.distance)

    def mouths_left_out(self, own: Assembly, holes: Sequence[RoundHole]) -> list[LeftOut]:
        """Countersinks and chamfers of holes that an assembly in the unit frame fills, but those of `holes`,
        which it fills altogether."""
        others = [hole for hole in self._assemblies.round_holes if not any(hole is one for one in holes)]
        return mouths_left_out(others, own.distance)

    def _told(self, tree: FeatureTree) -> None:
        seen = self._seen
        seen.append(seen[-1] if seen and seen[-1].objective > tree.objective else tree)
        self._report(seen[-1], _SHARE * len(seen) / (len(seen) + _HALFWAY))

    def _report(self, tree: FeatureTree, share: float) -> None:
        iou, count = volume_iou(tree, self._samples), len(tree.features)
        made = partial(self.assembly, tree)
        self._request.run.told(Progress("features", count, count, count, iou, share, made))


def _tree_of(own: Assembly) -> FeatureTree:
    """The parts of an assembly in the unit frame, each a feature."""
    none = np.zeros(0, bool)
    return FeatureTree([Feature(added, part, none, 0) for part, added in flattened(own)])


def freeform_warnings(shape: Shape, whole: Assembly) -> tuple[str, ...]:
    """Which parts are no features, and where."""
    found = [part for part in whole.parts if part.name.startswith(FREEFORM)]
    if not found:
        return ()
    middles = (shape.frame.to_unit(part.bounds().mean(axis=0)[None])[0] for part in found)
    places = (place_in(shape, middle) for middle in middles)
    named = ", ".join(f"{part.name} ({place})" for part, place in zip(found, places, strict=True))
    return (
        f"kept as freeform: {named}: no feature explains the shape there, so steps follow its own form; "
        "without them the surface would be more than 3 % of the longest side off",
    )


def volume_iou(tree: FeatureTree, samples: FitSamples) -> float:
    """Over the samples that fill the box."""
    rest = slice(samples.near, None)
    covered, inside, weight = tree.at(samples.points[rest]), samples.inside[rest], samples.weight[rest]
    return float(weight[covered & inside].sum() / max(float(weight[covered | inside].sum()), 1e-9))
