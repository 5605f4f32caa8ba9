"""A fit of solids that begins with features read off the surface, and the assembly of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

import numpy as np

from partwright.approximation.part_roles import FREEFORM, with_role_names
from partwright.approximation.plain_numbers import plain_move, with_plain_numbers
from partwright.approximation.sketches.ends import with_open_ends
from partwright.approximation.sketches.holes import holes_apart, is_empty, merged_holes
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.group_copies import in_runs
from partwright.errors import CancelledError
from partwright.fields import Cylinder
from partwright.meshing import has_exact_mesh
from partwright.methods import Checkpoint, FitRequest, Progress
from partwright.metrics.deviation import place_in
from partwright.shapes import Shape
from partwright.superfrusta.feature_freeform import with_freeform
from partwright.superfrusta.feature_groups import grouped
from partwright.superfrusta.feature_pockets import with_pockets
from partwright.superfrusta.feature_pruning import pruned
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree, image_of
from partwright.superfrusta.flat_tree import flattened
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings

_SHARE = 0.3  # of a fit's work that features are at most
_HALFWAY = 10  # steps after which half of that is done
_PLAIN = 1e-4  # unit lengths: how far numbers are moved to become plain
SURE = 0.95
"""R from which on a tree of features is the result, and no other is looked for."""


def wants_features(request: FitRequest[Settings]) -> bool:
    """Whether the fit may begin with features: from nothing, with cuts, and not down to every size."""
    settings = request.settings
    allowed = getattr(settings, "profiles", False) and settings.subtract and not settings.curve
    return bool(allowed and request.start is None)


def feature_tree(
    request: FitRequest[Settings], samples: FitSamples, checkpoint: Checkpoint
) -> tuple[FeatureTree | None, bool]:
    """The best tree of features within the part budget, and whether it was interrupted; none where the
    surface has no sections, or where it misses the IoU that is asked for.

    Raises:
        CancelledError: cancelled before there was a feature.
    """
    settings = request.settings
    seen: list[FeatureTree] = []

    def report(tree: FeatureTree, share: float) -> None:
        iou, count = volume_iou(tree, samples), len(tree.features)
        made = partial(assembly, request.shape, tree)
        request.run.told(Progress("features", count, count, count, iou, share, made))

    def told(tree: FeatureTree) -> None:
        seen.append(seen[-1] if seen and seen[-1].objective > tree.objective else tree)
        report(seen[-1], _SHARE * len(seen) / (len(seen) + _HALFWAY))

    search = FeatureSearch(request.shape, samples, settings.alpha, checkpoint, settings.max_parts, told)
    try:
        tree = search.run()
        if tree is not None and settings.min_iou is None:
            tree = pruned(search, tree)
        if tree is not None:
            seen.append(tree)
            report(tree, _SHARE)
        checkpoint()
    except CancelledError:
        if not seen:
            raise
        return seen[-1], True
    if tree is None or settings.min_iou is None:
        if tree is not None:
            tree = with_pockets(tree, samples.points)
            tree = with_freeform(search, tree, partial(_as_made, request.shape), settings.max_parts)
        return tree, False
    for count in range(1, len(tree.features) + 1):
        shorter = tree.first(count)
        if volume_iou(shorter, samples) >= settings.min_iou:
            return search.scored(shorter), False
    return None, False


def mended_assembly(
    request: FitRequest[Settings], samples: FitSamples, whole: Assembly
) -> tuple[Assembly, float]:
    """Solids that were found by the search, with freeform where they are far off; itself where nothing is or
    nothing helps. And how far it is off even so, unit lengths, 0 where that is not far."""
    shape, settings = request.shape, request.settings
    if not has_exact_mesh(whole):
        return whole, 0.0
    search = FeatureSearch(shape, samples, settings.alpha)
    if search.body.is_empty() or search.volume <= 0:
        return whole, 0.0
    none = np.zeros(0, bool)
    leaves = flattened(_in_unit_frame(shape, whole))
    tree = search.scored(FeatureTree([Feature(added, part, none, 0) for part, added in leaves]))
    better = with_freeform(search, tree, partial(_as_made, shape), settings.max_parts)
    changed = len(better.features) > len(tree.features)
    return assembly(shape, better) if changed else whole, better.off


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


def assembly(shape: Shape, tree: FeatureTree) -> Assembly:
    """The features as a tree of unions and differences, named, in the shape's own units."""
    return with_role_names(dataclasses.replace(_plain(shape, tree), unit=shape.unit))


def _plain(shape: Shape, tree: FeatureTree) -> Assembly:
    """The same without names, as it is measured: rounded numbers may leave skins."""
    whole = grouped(_numbered(tree.features, shape))
    whole = whole.scaled(1 / shape.frame.scale).translated(shape.frame.centre)
    return _with_plain_numbers(whole, _PLAIN / shape.frame.scale)


def _as_made(shape: Shape, tree: FeatureTree) -> Assembly:
    """What becomes of the tree, in the unit frame."""
    return _in_unit_frame(shape, _plain(shape, tree))


def _in_unit_frame(shape: Shape, whole: Assembly) -> Assembly:
    x, y, z = (-float(middle) for middle in shape.frame.centre)
    return whole.translated((x, y, z)).scaled(shape.frame.scale)


def _with_plain_numbers(node: Assembly, within: float) -> Assembly:
    children: list[Node] = []
    for child, copies in in_runs(node):
        if isinstance(child, Part):
            children.append(with_plain_numbers(child, within))
            continue
        plain = _with_plain_numbers(child, within)
        children.append(plain)
        for k, copy in enumerate(copies, start=2):  # exactly what the first is
            move = plain_move(copy.move, within)
            children.append(dataclasses.replace(copy, move=move).of(plain, k))
    return dataclasses.replace(node, children=tuple(children))


def _numbered(features: Sequence[Feature], shape: Shape) -> list[Feature]:
    """Round holes of profiles apart, each size once; ends that are open further out; names until they say
    more."""
    distance = shape.unit_distance
    result: list[Feature] = []
    drilled: list[Part] = []
    for i, feature in enumerate(features):
        if feature.freeform:
            result.append(feature)
            continue
        part, holes = holes_apart(feature.part) if feature.added else (feature.part, ())
        if i and not all(is_empty(hole, distance) for hole in holes):
            part, holes = feature.part, ()  # cut by themselves they would open what is there before
        parts = [(part, feature.added), *((hole, False) for hole in holes)]
        for k, (one, added) in enumerate(parts):
            longer = one if i == k == 0 else with_open_ends(one, added, distance)
            if feature.image is not None and longer is not one:
                image = with_open_ends(image_of(one, feature.image), added, distance)
                if image.field.bounds()[1][2] != longer.field.bounds()[1][2]:
                    longer = one  # which goes on in but one of both places
            own = dataclasses.replace(feature, part=longer, added=added)
            if not added and isinstance(longer.field, Cylinder) and is_empty(longer, distance):
                drilled += own.parts
            else:
                result.append(own)
    none = np.zeros(0, bool)
    result += [Feature(False, hole, none, 0) for hole in merged_holes(drilled, distance)]
    stems = {True: "part", False: "cut"}
    names = [f"{stems[f.added]}_{i:02d}" for i, f in enumerate(result, start=1)]
    for k, i in enumerate((i for i, f in enumerate(result) if f.freeform), start=1):
        names[i] = f"{FREEFORM}_{k}"
    return [
        dataclasses.replace(f, part=dataclasses.replace(f.part, name=name))
        for f, name in zip(result, names, strict=True)
    ]
