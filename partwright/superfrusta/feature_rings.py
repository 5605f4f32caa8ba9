"""Round holes that a ring stands in: a plate is bored as wide as the boss on it, and not around the boss.

What a tree lacks besides a ring has a hole as wide as that is outside. The same body is there where the hole
is as wide as the ring's own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.profile_parts import with_profile
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder, Extrusion, Tube
from partwright.fields.profile import Loop, Profile, circle, circle_of
from partwright.superfrusta.feature_steps import FeatureTree

_SAME = 2e-4  # of the samples, that may lie otherwise
_FLUSH = 3e-3  # unit lengths: how far walls that are one may lie apart
_PARALLEL = 1e-6  # of a cosine


@dataclass(frozen=True)
class _Ring:
    """A point on its axis and the way along (3,), and its radii."""

    middle: NDArray[np.float64]
    axis: NDArray[np.float64]
    outer: float
    inner: float


def with_shared_bores(tree: FeatureTree, points: NDArray[np.float32]) -> FeatureTree:
    """The tree with every round hole in which a ring stands as wide as the ring's, where that is the same at
    points (N, 3)."""
    covered = tree.at(points)
    for i, feature in enumerate(tree.features):
        ring = _ring(feature.part) if feature.added and feature.image is None else None
        if ring is None:
            continue
        for k, other in enumerate(tree.features):
            narrow = _narrowed(other.part, ring, other.added)
            if k == i or narrow is None or other.part.instances != feature.part.instances:
                continue
            features = [*tree.features[:k], replace(other, part=narrow), *tree.features[k + 1 :]]
            one = replace(tree, features=features)
            if float((one.at(points) != covered).mean()) < _SAME:
                tree = one
    return tree


def _ring(part: Part) -> _Ring | None:
    field, frame = part.field, rotation_matrix(part.rotation)
    middle = np.array(part.translation)
    if isinstance(field, Tube):
        return _Ring(middle, frame[:, 2], field.radius, field.radius - field.thickness)
    if not isinstance(field, Extrusion) or field.taper or len(field.profile.holes) != 1:
        return None
    outer, inner = (circle_of(loop) for loop in field.profile.loops)
    if outer is None or inner is None or math.dist(outer[1], inner[1]) > _FLUSH:
        return None
    return _Ring(middle + frame[:, :2] @ outer[1], frame[:, 2], outer[0], inner[0])


def _narrowed(part: Part, ring: _Ring, added: bool) -> Part | None:
    """With the holes in which a ring stands as wide as that's own; None where it has none."""
    field, frame = part.field, rotation_matrix(part.rotation)
    if abs(float(frame[:, 2] @ ring.axis)) < 1 - _PARALLEL:
        return None
    at = (ring.middle - part.translation) @ frame[:, :2]

    def narrowed(loop: Loop) -> Loop:
        radius, middle = circle_of(loop) or (0.0, (0.0, 0.0))
        around = abs(radius - ring.outer) < _FLUSH and math.dist(at, middle) < _FLUSH
        return circle(ring.inner, middle) if around else loop

    if isinstance(field, Cylinder) and not added:
        around = abs(field.radius - ring.outer) < _FLUSH and math.hypot(*at) < _FLUSH
        return replace(part, field=replace(field, radius=ring.inner)) if around else None
    if isinstance(field, Extrusion) and added and not (field.taper or field.has_rims):
        holes = tuple(narrowed(loop) for loop in field.profile.holes)
        if holes != field.profile.holes:
            bored = with_profile(part, Profile(field.profile.outline, holes))
            return replace(bored, instances=part.instances, name=part.name)
    return None
