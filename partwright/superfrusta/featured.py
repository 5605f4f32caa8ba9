"""A fit of solids that begins with features read off the surface, and the assembly of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import partial

import numpy as np

from partwright.approximation.part_roles import with_role_names
from partwright.approximation.plain_numbers import plain_move, with_plain_numbers
from partwright.approximation.sketches.ends import with_open_ends
from partwright.approximation.sketches.holes import holes_apart, is_empty, merged_holes
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.group_copies import in_runs
from partwright.errors import CancelledError
from partwright.fields import Cylinder
from partwright.methods import Checkpoint, FitRequest, Progress
from partwright.shapes import Shape
from partwright.superfrusta.feature_groups import grouped
from partwright.superfrusta.feature_pockets import with_pockets
from partwright.superfrusta.feature_pruning import pruned
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree, image_of
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
        return (with_pockets(tree, samples.points) if tree is not None else None), False
    for count in range(1, len(tree.features) + 1):
        shorter = tree.first(count)
        if volume_iou(shorter, samples) >= settings.min_iou:
            return search.scored(shorter), False
    return None, False


def volume_iou(tree: FeatureTree, samples: FitSamples) -> float:
    """Over the samples that fill the box."""
    rest = slice(samples.near, None)
    covered, inside, weight = tree.at(samples.points[rest]), samples.inside[rest], samples.weight[rest]
    return float(weight[covered & inside].sum() / max(float(weight[covered | inside].sum()), 1e-9))


def assembly(shape: Shape, tree: FeatureTree) -> Assembly:
    """The features as a tree of unions and differences, named, in the shape's own units."""
    features = _numbered(tree.features, shape)
    whole = grouped(features).scaled(1 / shape.frame.scale).translated(shape.frame.centre)
    whole = _with_plain_numbers(whole, _PLAIN / shape.frame.scale)
    return with_role_names(dataclasses.replace(whole, unit=shape.unit))


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
    return [
        dataclasses.replace(f, part=dataclasses.replace(f.part, name=f"{stems[f.added]}_{i:02d}"))
        for i, f in enumerate(result, start=1)
    ]
