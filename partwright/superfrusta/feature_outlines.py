"""Outlines in a tree of features without corners that nothing shows.

They lie within other bodies, where a section of the whole shape was read for a rib of it, or in the open,
where a gap follows the wall that it takes away.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType
from numpy.typing import NDArray

from partwright.approximation.profile_parts import revolved_part, with_profile
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Revolution
from partwright.fields.profile import Loop, Profile
from partwright.fields.profile_distance import profile_distance
from partwright.superfrusta.feature_pruning import mask_of
from partwright.superfrusta.feature_steps import Feature, FeatureTree, fold, within_box

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_MOST = 16  # corners of an outline that is looked at
_COPIES = 8  # of a feature, that are looked at
_ACROSS, _ALONG = 32, 12  # points each way across what changes in an outline, and along or around it
_OTHER = 0.01  # of the points that an outline gains or loses, which the tree may
_CHORD = 1e-4  # unit lengths: how far chords of an outline may be off
_THIN = 2e-4  # unit lengths: half the width of what an outline may gain or lose anyway
_LOSS = 3e-4  # of R, that plainer outlines may cost, all together
_FEW = 3  # of the samples near a feature, in which the trees may differ besides


def with_plain_outlines(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree with fewer corners, or a rectangle, for outlines of features where that is the same solid."""
    tree = search.scored(tree)
    least = tree.score - _LOSS
    for i in range(len(tree.features)):
        while True:
            plainer = _plainer(search, tree, i, least)
            if plainer is None:
                break
            tree = plainer
    return tree


def _plainer(search: FeatureSearch, tree: FeatureTree, i: int, least: float) -> FeatureTree | None:
    """The tree with a plainer outline of one feature, the plainest that is the same solid. least: of R."""
    feature = tree.features[i]
    boxes = [copy.bounds() for part in feature.parts for copy in part.copies]
    near = search.points[np.any([within_box(search.points, *box) for box in boxes], axis=0)]
    masks = [mask_of(other, near) for other in tree.features]
    before = _folded(tree, masks)
    for profile in _profiles(feature):
        try:
            other = _with_profile(feature, profile)
        except ParameterError:
            continue
        own = mask_of(other, near)
        changed = own != masks[i]
        after = _folded(tree, [own if k == i else mask for k, mask in enumerate(masks)])
        if (after != before).sum() > _OTHER * changed.sum() + _FEW:
            continue
        features = [other if k == i else f for k, f in enumerate(tree.features)]
        plainer = replace(tree, features=features, steps=())
        there = _points_between(feature.part, profile)
        if (tree.at(there) != plainer.at(there)).sum() <= _OTHER * len(there):
            plainer = search.scored(plainer)
            if plainer.score >= least:
                return plainer
    return None


def _folded(tree: FeatureTree, masks: list[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    steps = ((feature.added, mask) for feature, mask in zip(tree.features, masks, strict=True))
    return fold(steps, len(masks[0]))


def _profiles(feature: Feature) -> Iterator[Profile]:
    """With a plainer outline: what fills its box, and, of what is added, without corners that follow one
    another, the most of them first."""
    field = feature.part.field
    if feature.freeform or not isinstance(field, Extrusion | Revolution) or _is_shaped(field):
        return
    loop, holes = field.profile.outline, field.profile.holes
    count = len(loop)
    if not 3 < count <= _MOST:
        return
    if isinstance(field, Extrusion) and (count > 4 or any(bulge for *_, bulge in loop)):
        low, high = field.profile.bounds()
        width, depth = (high - low).tolist()
        yield from _made(Profile.rectangle(width, depth).moved((low + high) / 2).outline, holes)
    if not feature.added:
        return
    for gone in range(count - 3, 0, -1):
        for first in range(count):
            left = [loop[(first + k) % count] for k in range(count - gone)]
            (x, y, _), rest = left[-1], left[:-1]
            yield from _made((*rest, (x, y, 0.0)), holes)


def _is_shaped(field: Extrusion | Revolution) -> bool:
    return isinstance(field, Extrusion) and bool(field.taper or field.has_rims)


def _made(outline: Loop, holes: tuple[Loop, ...]) -> Iterator[Profile]:
    try:
        yield Profile(outline, holes)
    except ParameterError:  # sides cross
        return


def _with_profile(feature: Feature, profile: Profile) -> Feature:
    """The feature with another profile, by the name of a solid where it has one, and as many sides fewer."""
    part = feature.part
    assert isinstance(part.field, Extrusion | Revolution)
    if isinstance(part.field, Extrusion):
        other = with_profile(part, profile)
    else:
        frame = rotation_matrix(part.rotation)
        x, y, z = (frame.T @ np.array(part.translation)).tolist()
        other = revolved_part(profile.moved((0.0, z)), frame, np.array([x, y, 0.0]), part.field.angle)
    fewer = len(part.field.profile.corners) - len(profile.corners)
    whole = replace(other, name=part.name, instances=part.instances)
    return replace(feature, part=whole, sides=max(feature.sides - fewer, 0))


def _points_between(part: Part, other: Profile) -> NDArray[np.float32]:
    """(N, 3) points of a part and its copies where its profile and another are not the same."""
    field = part.field
    assert isinstance(field, Extrusion | Revolution)
    flat = _between(field.profile, other)
    steps = (np.arange(_ALONG) + 0.5) / _ALONG
    if isinstance(field, Extrusion):
        places = [np.column_stack([flat, np.full(len(flat), (step - 0.5) * field.height)]) for step in steps]
    else:
        turns = steps * math.radians(field.angle)
        places = [
            np.column_stack([flat[:, 0] * math.cos(a), flat[:, 0] * math.sin(a), flat[:, 1]]) for a in turns
        ]
    local = np.concatenate(places)
    there = [local @ rotation_matrix(copy.rotation).T + copy.translation for copy in part.copies[:_COPIES]]
    return np.concatenate(there).astype(np.float32)


def _between(one: Profile, other: Profile) -> NDArray[np.float64]:
    """(N, 2) points within one of two profiles but not the other, none where these are as good as one."""
    lines = [[np.asarray(line) for line in profile.polylines(_CHORD)] for profile in (one, other)]
    first, second = (CrossSection(line, FillRule.EvenOdd) for line in lines)
    changed = ((first - second) + (second - first)).offset(-_THIN, JoinType.Miter)
    if changed.is_empty():
        return np.zeros((0, 2))
    x0, y0, x1, y1 = changed.bounds()
    steps = (np.arange(_ACROSS) + 0.5) / _ACROSS
    x, y = np.meshgrid(x0 + steps * (x1 - x0), y0 + steps * (y1 - y0), indexing="ij")
    grid = np.column_stack([x.ravel(), y.ravel()])
    inside, also = (profile_distance(profile, grid) for profile in (one, other))
    return grid[((inside < 0) != (also < 0)) & (np.minimum(np.abs(inside), np.abs(also)) > _THIN / 2)]
