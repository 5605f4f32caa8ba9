"""Cuts of one section, one on top of the other, as one: the plates of a body, each with the slits of its
outline, leave every slit twice, and whoever moves one of them closes half of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from partwright.approximation.sketches.ends import longer
from partwright.approximation.sketches.holes import is_empty, points_within
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Extrusion
from partwright.superfrusta.feature_groups import same_solid
from partwright.superfrusta.feature_steps import Feature

Distance = Callable[[np.ndarray], np.ndarray]

_SAME = 2e-3  # unit lengths: how far two that go from end to end of both may differ


def with_cuts_once(features: Sequence[Feature], distance: Distance) -> list[Feature]:
    """Features in order, of two such cuts one from end to end of both, in the place of the later, where all
    of it is empty in the shape. distance: (N,) of that at points (N, 3), unit lengths."""
    result: list[Feature] = []
    for feature in features:
        later = feature
        for earlier in list(result):
            both = _both(earlier, later, distance)
            if both is not None:
                later = replace(later, part=both)
                result = [one for one in result if one is not earlier]
        result.append(later)
    return result


def _both(one: Feature, other: Feature, distance: Distance) -> Part | None:
    copies = len(one.part.copies), len(other.part.copies)
    if not (_is_upright_cut(one) and _is_upright_cut(other)) or copies[0] != copies[1]:
        return None
    whole = _as_long(one.part, other.part)
    if not same_solid(whole, _as_long(other.part, one.part), _SAME):
        return None
    seen = all(len(points_within(copy)) for copy in whole.copies)
    return whole if seen and is_empty(whole, distance) else None


def _is_upright_cut(feature: Feature) -> bool:
    """Round ones are drilled holes, which are one already."""
    field = feature.part.field
    upright = isinstance(field, Box) or (isinstance(field, Extrusion) and not (field.taper or field.has_rims))
    return upright and not (feature.added or feature.freeform or feature.image)


def _as_long(part: Part, other: Part) -> Part:
    """A part from the lowest to the highest end of itself and of the nearest copy of another."""
    assert isinstance(part.field, Box | Extrusion)
    place, axis = np.array(part.translation), rotation_matrix(part.rotation)[:, 2]
    nearest = min(other.copies, key=lambda copy: float(np.linalg.norm(copy.translation - place)))
    low, high = nearest.field.bounds()
    frame = rotation_matrix(nearest.rotation)
    middle = (nearest.translation + frame @ (low + high) / 2 - place) @ axis
    reach, half = np.abs(frame.T @ axis) @ (high - low) / 2, part.field.bounds()[1][2]
    down, up = min(-half, middle - reach) + half, max(half, middle + reach) - half
    x, y, z = (place + axis * (up + down) / 2).tolist()
    return replace(part, field=longer(part.field, float(up - down)), translation=(x, y, z))
