"""Fillets and chamfers around the ends of an extruded section, measured on the faces that lean there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from partwright.approximation.sketches.rim_walls import depth_in_own_walls
from partwright.fields.profile import Profile, Side
from partwright.fields.profile_collapses import first_collapse
from partwright.fields.profile_distance import profile_distance
from partwright.fields.rims import Rim
from partwright.shapes.topology import area_vectors

SHARP = Rim(0.0, 0.0)
_LEANS = (0.02, 0.9998)  # of a face's normal across the ends
_LEAST = 6e-3  # unit lengths: smaller rims are sharp
_MOST = 0.3
_ALIKE = 0.02  # of its depth, by which vertices of one rim may differ
_AT_45 = 0.025  # of the normal of a chamfer
_COVERED = 0.7  # of a rim's length, that has to be there
_OFF = 2e-3  # unit lengths: how far a vertex may lie beyond a wall or an end
_STEPS = 12


class Leaning(NamedTuple):
    """Faces of a body that are neither flat nor upright: corners (F, 3, 3), areas (F,), of their normals
    the part upwards (F,), and the faces' boxes: lowest and highest corners (F, 3)."""

    corners: np.ndarray
    area: np.ndarray
    upwards: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

    @classmethod
    def of(cls, vertices: np.ndarray, faces: np.ndarray) -> Leaning:
        corners = vertices[faces]
        normal = area_vectors(corners)
        area = np.linalg.norm(normal, axis=1) / 2
        upwards = normal[:, 2] / np.maximum(2 * area, 1e-300)
        leans = (np.abs(upwards) > _LEANS[0]) & (np.abs(upwards) < _LEANS[1])
        corners = corners[leans]
        first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
        lowest = np.minimum(np.minimum(first, second), third)
        highest = np.maximum(np.maximum(first, second), third)
        return cls(corners, area[leans], upwards[leans], lowest, highest)


def bottom_rim(faces: Leaning, profile: Profile, low: float) -> Rim:
    """Of a profile extruded from a height on, however far."""
    near = (faces.lowest[:, 2] - low > -_OFF) & (faces.highest[:, 2] - low < _MOST)
    return _rim(faces, near & (faces.upwards < 0), low, -1.0, profile)


def top_rim(faces: Leaning, profile: Profile, high: float) -> Rim:
    """Of a profile extruded to a height, from wherever."""
    near = (high - faces.highest[:, 2] > -_OFF) & (high - faces.lowest[:, 2] < _MOST)
    return _rim(faces, near & (faces.upwards > 0), high, 1.0, profile)


def _rim(faces: Leaning, near: np.ndarray, end: float, upwards: float, profile: Profile) -> Rim:
    """near: (F,) faces that face beyond the end, and lie near it. end: its height. upwards: 1 where what is
    beyond it is above, else -1."""
    low, high = profile.bounds()
    least, most = low - _OFF, high + _OFF
    lowest, highest = faces.lowest, faces.highest
    near = near & (lowest[:, 0] > least[0]) & (highest[:, 0] < most[0])
    own = np.flatnonzero(near & (lowest[:, 1] > least[1]) & (highest[:, 1] < most[1]))
    lengths = np.array([_perimeter(loop) for loop in profile.sides])
    area = faces.area[own]
    if area.sum() < _COVERED * _LEAST * lengths.sum():
        return SHARP
    corners, facing = faces.corners[own], upwards * faces.upwards[own]
    off = np.maximum(upwards * (end - corners[..., 2]), 0)
    flat = corners[..., :2].reshape(-1, 2)
    nearest = -profile_distance(profile, flat).reshape(-1, 3)
    facing_away = area_vectors(corners)[:, :2]
    facing_away = facing_away / np.maximum(np.linalg.norm(facing_away, axis=1), 1e-300)[:, None]
    within, deep = nearest.min(axis=1) >= -_OFF, nearest.copy()
    deep[within] = depth_in_own_walls(profile, flat.reshape(-1, 3, 2)[within], facing_away[within])
    deep = np.where(np.isnan(deep), nearest, deep)
    known = within & (deep.min(axis=1) >= -_OFF) & (deep.max(axis=1) <= _MOST)
    deep = np.maximum(deep, 0)
    tilted = known & (np.abs(facing - math.sqrt(0.5)) < _AT_45)
    # All along a chamfer both lengths add up to its own. A fillet is of the circle that touches wall and end.
    chamfer, fillet = deep + off, deep + off + np.sqrt(2 * deep * off)
    around = _Outline(profile, flat.reshape(-1, 3, 2), lengths)
    found = around.depth(chamfer, tilted, area, math.sqrt(2))
    if found:
        return Rim(0.0, found)
    return Rim(around.depth(fillet, known, area, math.pi / 2), 0.0)


class _Outline(NamedTuple):
    """A profile, the corners (F, 3, 2) of faces as seen from above, and the length of each of its loops."""

    profile: Profile
    flat: np.ndarray
    lengths: np.ndarray

    def depth(self, depths: np.ndarray, own: np.ndarray, area: np.ndarray, width: float) -> float:
        """That on which most corners of faces agree, where these go around each loop; else 0.

        depths: (F, 3) of a rim through each corner. own: (F,) faces that may be its. area: (F,). width: of a
        rim that is 1 deep."""
        common = _most_common(depths[own].ravel(), np.repeat(area[own], 3))
        if not _LEAST <= common < math.inf:
            return 0.0
        own = own & (np.abs(depths - common) < _ALIKE * common + _OFF / 4).all(axis=1)
        area, depths, flat = area[own], depths[own], self.flat[own].reshape(-1, 2)
        least = _COVERED * common * width * self.lengths
        if area.sum() < least.sum():
            return 0.0
        apart = [
            np.abs(profile_distance(self.profile, flat, sides)).reshape(-1, 3).sum(axis=1)
            for sides in _loops(self.profile)
        ]
        there = np.bincount(np.argmin(apart, axis=0), area, minlength=len(least))
        return 0.0 if (there < least).any() else float(np.average(depths.ravel(), weights=np.repeat(area, 3)))


def _loops(profile: Profile) -> Iterator[np.ndarray]:
    """Of each loop which corners (V,) are its own."""
    corner = np.arange(len(profile.corners))
    return ((corner >= first) & (corner < last) for first, last in pairwise(profile.starts.tolist()))


def _most_common(values: np.ndarray, weights: np.ndarray) -> float:
    """The middle of the narrow range that holds the most weight."""
    known = np.isfinite(values)
    if not known.any():
        return math.inf
    values, weights = values[known], weights[known]
    order = np.argsort(values)
    values, sums = values[order], np.concatenate([[0.0], np.cumsum(weights[order])])
    ends = np.searchsorted(values, values * (1 + _ALIKE), side="right")
    first = int((sums[ends] - sums[:-1]).argmax())
    return float(np.median(values[first : ends[first]]))


def _perimeter(sides: Sequence[Side]) -> float:
    return sum(abs(s.sweep) * s.radius if s.centre else math.dist(s.start, s.end) for s in sides)


def limited(rims: tuple[Rim, Rim], profile: Profile, height: float) -> tuple[Rim, Rim]:
    """Rims as deep as all sides of the profile reach where they are a little deeper, as at a corner of their
    radius, and that meet half way up where they would go a little further."""
    deepest = max(rim.depth for rim in rims)
    least = first_collapse(profile, deepest) if deepest else math.inf
    bottom, top = (
        Rim(*(least if least < value < (1 + _ALIKE) * least else value for value in rim)) for rim in rims
    )
    total = bottom.depth + top.depth
    share = height / total if height < total < (1 + _ALIKE) * height else 1.0
    return Rim(*(share * value for value in bottom)), Rim(*(share * value for value in top))


def rimmed_body(section: CrossSection, rims: tuple[Rim, Rim], height: float, outer: bool) -> Manifold:
    """The section extruded from 0, its rims in steps outside or inside of them. Each goes on to the middle:
    what only touches is not one body but for rounding."""
    bottom, top = rims
    middle = (bottom.depth + height - top.depth) / 2
    slabs = []
    for rim, at_top in ((bottom, False), (top, True)):
        points = rim.steps(_STEPS) if rim.depth else []
        for (start, begin), (deep, end) in pairwise(points):
            inner = section.offset(-(start if outer else deep), JoinType.Round, 2.0, 0)
            if not inner.is_empty() and begin > end:
                low, high = (middle, height - end) if at_top else (end, middle)
                slabs.append(Manifold.extrude(inner, high - low).translate((0, 0, low)))
    wall = height - bottom.depth - top.depth
    if wall > 1e-6:
        slabs.append(Manifold.extrude(section, wall).translate((0, 0, bottom.depth)))
    return sum(slabs[1:], slabs[0])
