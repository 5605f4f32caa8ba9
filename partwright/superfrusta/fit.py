"""A whole fit of method 1: samples, features where they are asked for, the search, repeats, the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.errors import CancelledError, EmptyShapeError
from partwright.meshing import has_exact_mesh, mesh_assembly
from partwright.methods import Checkpoint, CurvePoint, FitRequest, Fitted, Outcome, timed
from partwright.shapes import Shape
from partwright.superfrusta.far_places import Solid
from partwright.superfrusta.feature_assembly import in_unit_frame
from partwright.superfrusta.feature_drilling import hole_warnings
from partwright.superfrusta.feature_mouths import mouth_warnings
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.featured import SURE, FeaturedFit, freeform_warnings, wants_features
from partwright.superfrusta.hole_search import HoleSearch
from partwright.superfrusta.left_out import left_out, left_out_warnings
from partwright.superfrusta.outcome import assembly_of
from partwright.superfrusta.rejoining import rejoined
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.several_growths import SeveralGrowths
from partwright.superfrusta.sharp_edges import sharp_edge_warnings
from partwright.superfrusta.starting import starting_rows
from partwright.superfrusta.symmetric_fit import RepeatedPart

if TYPE_CHECKING:
    import trimesh

_FAR_FEWER = 0.75  # of the parts
_DEARER = 2.0  # times the price of a feature, that a part of the search has beside it


def fit(request: FitRequest[Settings]) -> Fitted:
    """Fits an assembly of SuperFrusta to a shape.

    The start is refined and continued; its locked parts come first and stay bit for bit.

    Raises:
        EmptyShapeError: nothing could be fitted (the shape is thinner than the samples can see).
        CancelledError: cancelled before there was a part.
        SettingError: the start is no union of SuperFrusta, or a locked name is none of its parts.
    """
    shape, settings, run = request.shape, request.settings, request.run
    rows, fixed = starting_rows(shape, request.start, request.locked, settings)
    seconds: dict[str, float] = {}
    checkpoint = Checkpoint(run.cancel)
    with timed(seconds, "prepare"):
        samples = FitSamples.of(shape, settings, run, checkpoint)
    features: FeatureTree | None = None
    featured = FeaturedFit(request, samples, checkpoint)
    if wants_features(request):
        with timed(seconds, "features"):
            features, interrupted = featured.tree()
        if features is not None and interrupted:
            return _of_features(shape, featured, featured.assembly(features), "interrupted", seconds, [])
        if features is not None and (features.score >= SURE or settings.min_iou is not None):
            with timed(seconds, "freeform"):
                features = featured.mended(features)
            return _of_features(shape, featured, featured.assembly(features), "converged", seconds, [])
    assembled = partial(assembly_of, shape, settings=settings, fixed=fixed)
    search = ResidualFit(samples, settings, run.told, len(fixed), assembled, checkpoint, seconds=seconds)
    holes = HoleSearch.of(shape, search, rows)
    try:
        outcome = search.run(rows) if settings.attempts == 1 else SeveralGrowths(search).run(rows)
        if settings.symmetry and search.best is not None:
            search.find_repeats(shape)
    except CancelledError:
        if search.best is None and search.earlier is None:
            raise
        outcome = "interrupted"
        search.choose()
    search.enforce_budget()
    if search.best is None:
        advice = ", or use --quality normal" if settings.near < Settings.near else ""
        raise EmptyShapeError(
            f"{shape.name}: no part could be placed; the shape has no volume that {settings.near} samples "
            f"can see. Check its thickness{advice}"
        )
    search.leaves = search.leaves or [RepeatedPart(row) for row in search.best]
    whole_search = outcome != "interrupted" and not settings.curve

    def of_leaves(leaves: list[RepeatedPart]) -> Assembly:
        return assembled(np.stack([leaf.row for leaf in leaves]), moves=[leaf.moves for leaf in leaves])

    meshed = _Meshed(shape, of_leaves)
    try:
        known = holes.cut()
        if whole_search:
            if search.mending:
                search.polish(shape, known)
            with search.timed("rejoin"):
                search.leaves = rejoined(shape, search.samples, search.leaves, search.settings, meshed, known)
    except CancelledError:
        outcome = "interrupted"
    whole = found = of_leaves(search.leaves)
    if features is not None:
        # Of the search none says how it would be drawn: there a part costs more than a feature does.
        count = len(search.leaves)
        rival = search.objective(search.best, count) - (_DEARER - 1) * settings.alpha * count
        preferred = features.objective - features.off >= rival
        if outcome != "interrupted":
            with timed(seconds, "freeform"):
                whole, preferred = _mended(featured, features, whole, rival)
        elif preferred:
            whole = featured.assembly(features)
        if preferred:
            return _of_features(shape, featured, whole, outcome, search.seconds, search.history)
    whole = _with_locked(whole, request)
    curve: list[CurvePoint] = []
    for step in search.curve:
        smaller = curve[-1].assembly if curve else None
        one = assembled(step.rows, smaller=smaller)
        curve.append(CurvePoint(len(step.rows), step.score, step.iou, one))
    told = freeform_warnings(shape, whole)
    if wants_features(request) and outcome != "interrupted":
        own = in_unit_frame(shape, whole)
        missing = featured.holes_left_out(own)
        told += hole_warnings(shape, missing)
        told += mouth_warnings(shape, featured.mouths_left_out(own, missing))
    return Fitted(
        whole,
        outcome,
        search.seconds,
        search.history,
        tuple(reversed(curve)),
        warnings=told,
        surface=meshed.of(search.leaves) if whole is found else None,
    )


@dataclass
class _Meshed:
    """The surface of an assembly as it will be seen. The last one is kept: it may be the result's."""

    shape: Shape
    assembled: Callable[[list[RepeatedPart]], Assembly]
    leaves: list[RepeatedPart] | None = None
    mesh: trimesh.Trimesh | None = None

    def __call__(self, leaves: list[RepeatedPart]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Vertices (V, 3) in the unit frame and faces (F, 3)."""
        self.leaves, self.mesh = leaves, mesh_assembly(self.assembled(leaves))
        return self.shape.frame.to_unit(self.mesh.vertices), np.asarray(self.mesh.faces, np.int64)

    def of(self, leaves: list[RepeatedPart]) -> trimesh.Trimesh | None:
        """That of these, if they were the last."""
        return self.mesh if self.leaves is leaves else None


def _of_features(
    shape: Shape,
    featured: FeaturedFit,
    whole: Assembly,
    outcome: Outcome,
    seconds: dict[str, float],
    history: list[dict[str, float | str]],
) -> Fitted:
    told = freeform_warnings(shape, whole)
    if outcome != "interrupted" and has_exact_mesh(whole):
        with timed(seconds, "edges"):
            own = in_unit_frame(shape, whole)
            fitted = Solid.of(own)
            holes = featured.holes_left_out(own)
            mouths = featured.mouths_left_out(own, holes)
            apart = [
                detail
                for detail in left_out(shape, own, fitted)
                if not any(detail.is_beside(hole.middle) for hole in holes)
            ]
            told += hole_warnings(shape, holes) + mouth_warnings(shape, mouths)
            told += left_out_warnings(shape, apart) + sharp_edge_warnings(shape, fitted, [*apart, *mouths])
    return Fitted(whole, outcome, seconds, history, warnings=told)


def _mended(
    featured: FeaturedFit, features: FeatureTree, whole: Assembly, rival: float
) -> tuple[Assembly, bool]:
    """The features, or what the search found, with freeform where it is far off; and whether it is the
    features.

    rival: the search's objective. The one that explains more is mended first, the other only where that does
    not bring it near, or with freeform and more parts: nothing may be far off that need not be. Where both
    stay far off, how far counts with each. A plainer assembly of the search that explains no less, and is
    near, is preferred.
    """

    def drawn_features() -> tuple[FeatureTree, Assembly]:
        tree = featured.mended(features)
        return tree, featured.assembly(tree)

    features_first = features.objective >= rival
    if features_first:
        mended, drawn = drawn_features()
        has_rival = len(whole.parts) < len(drawn.parts)
        ahead = mended.objective - mended.off >= rival
        if ahead and not (has_rival and featured.may_explain(whole, mended.score)):
            return drawn, True
    other = featured.mended_assembly(whole)
    if not features_first:
        if not other.off:
            return other.assembly, False
        mended, drawn = drawn_features()
    explains = not other.off and other.score >= mended.score
    if explains and _is_plainer(other.assembly, drawn, mended):
        preferred = False
    elif mended.off:
        preferred = mended.objective - mended.off >= rival - other.off
    else:
        preferred = other.off > 0 or mended.objective >= rival
    return (drawn if preferred else other.assembly), preferred


def _is_plainer(whole: Assembly, drawn: Assembly, features: FeatureTree) -> bool:
    """Whether what the search found has fewer parts than features that need freeform, or far fewer than those
    that do not: either then do not say how the shape would be drawn."""
    share = 1.0 if features.freeform else _FAR_FEWER
    return len(whole.parts) < share * len(drawn.parts)


def _with_locked(whole: Assembly, request: FitRequest[Settings]) -> Assembly:
    """With the locked parts' own numbers: the way to the unit frame and back rounds them."""
    for name in request.locked:
        given = request.start[name] if request.start is not None else None
        if given is None or given.instances:
            continue
        found = replace(
            whole[name], field=given.field, translation=given.translation, rotation=given.rotation
        )
        whole = whole.replace_part(name, found)
    return whole
