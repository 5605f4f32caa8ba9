"""A closed surface seen along a direction: where it is flat, and what lies between, as profiles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold

from partwright.approximation.sketches.outlines import fitted_loop, is_circle
from partwright.approximation.sketches.pinches import unpinched
from partwright.approximation.sketches.rims import Leaning
from partwright.approximation.sketches.slits import TOUCHING, touches_itself, without_slits
from partwright.approximation.sketches.tangents import with_tangents
from partwright.errors import ParameterError
from partwright.fields.profile import Loop, Profile
from partwright.rows import following
from partwright.shapes.topology import area_vectors

FINE, COARSE = 4e-4, 4e-3  # unit lengths: how far outlines may lie from sections
_MANY = 24  # sides, from which on fewer are looked for at the coarse tolerance
_FEWER = 0.5  # of the sides, that the coarse outline may have at most
_FLAT = math.cos(math.radians(0.6))
_UPRIGHT = math.sin(math.radians(0.6))
_WALLS = 0.5  # of the width of upright walls, that begin or end at a level
_LEAST_FLAT = 2e-4  # of the bounding rectangle: area of a level
_SAME_LEVEL = 2e-3
_MOST_LEVELS = 24
_ROUNDING = 2e-5  # unit lengths
_SLIT = 1.5  # tolerances: half the width of what is closed or cut where an outline touches itself
_SLIVER = 3e-5  # unit areas


@dataclass(frozen=True)
class Region:
    """A connected piece of a section. area: of it, holes taken off."""

    section: CrossSection
    area: float

    @cached_property
    def filled(self) -> CrossSection:
        """Without its holes."""
        return CrossSection([max(self.section.to_polygons(), key=_loop_area)], FillRule.Positive)

    @cached_property
    def profile(self) -> Profile | None:
        return profile_of(self.section)

    def outlines(self, holes: bool) -> Iterator[tuple[CrossSection, Profile | None]]:
        """The region, and also with its holes closed."""
        yield self.section, self.profile
        if holes and self.has_holes:
            yield self.filled, profile_of(self.filled)

    @property
    def has_holes(self) -> bool:
        return bool(self.section.num_contour() > 1)

    @cached_property
    def is_round(self) -> bool:
        """Whether its outline is a circle."""
        return is_circle(np.asarray(max(self.section.to_polygons(), key=_loop_area)), FINE)


@dataclass
class View:
    """A body turned so that `frame`'s third column is z: its points are frame @ points of the view."""

    body: Manifold
    frame: np.ndarray
    _sections: dict[float, list[Region]] = field(default_factory=dict)

    @classmethod
    def along(cls, body: Manifold, frame: np.ndarray) -> View:
        return cls(body.transform(np.column_stack([frame.T, np.zeros(3)])), frame)

    @cached_property
    def mesh(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (V, 3) and faces (F, 3), in the view."""
        mesh = self.body.to_mesh64()
        return np.asarray(mesh.vert_properties, float)[:, :3], np.asarray(mesh.tri_verts, np.int64)

    @cached_property
    def leaning(self) -> Leaning:
        return Leaning.of(*self.mesh)

    @cached_property
    def levels(self) -> list[float]:
        """Heights of flat faces, from the lowest point to the highest; where there is none between these,
        those at which upright walls begin and end."""
        vertices, _ = self.mesh
        corners, normal, area = self._faces
        flat = np.abs(normal[:, 2]) > 2 * area * _FLAT
        height, weight = corners[flat, :, 2].mean(axis=1), area[flat]
        low, high = float(vertices[:, 2].min()), float(vertices[:, 2].max())
        least = _LEAST_FLAT * float(np.prod(np.ptp(vertices[:, :2], axis=0)))
        found = sorted(_heights(height, weight, least), reverse=True)[:_MOST_LEVELS]
        inner = [z for _, z in found if low + _SAME_LEVEL < z < high - _SAME_LEVEL]
        if not inner:
            ends = (z for share, z in self.wall_ends if share > _WALLS)
            inner = [z for z in ends if low + _SAME_LEVEL < z < high - _SAME_LEVEL]
        return [low, *sorted(inner), high]

    @cached_property
    def wall_ends(self) -> list[tuple[float, float]]:
        """At which upright walls begin or end: what share of the width of all does, and the height."""
        corners, normal, area = self._faces
        upright = (np.abs(normal[:, 2]) < 2 * area * _UPRIGHT) & (area > 0)
        bottom, top = corners[upright, :, 2].min(axis=1), corners[upright, :, 2].max(axis=1)
        width = 2 * area[upright] / np.maximum(top - bottom, _SAME_LEVEL)
        ends, whole = [*_heights(bottom, width, 0.0), *_heights(top, width, 0.0)], float(width.sum())
        return [(one / whole, z) for one, z in ends]

    @cached_property
    def _faces(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Corners (F, 3, 3), normals (F, 3) twice as long as areas, areas (F,)."""
        vertices, faces = self.mesh
        corners = vertices[faces]
        normal = area_vectors(corners)
        return corners, normal, np.linalg.norm(normal, axis=1) / 2

    @property
    def slabs(self) -> Iterator[tuple[float, float]]:
        """Between levels."""
        return zip(self.levels[:-1], self.levels[1:], strict=True)

    def regions(self, height: float) -> list[Region]:
        """Connected pieces of the section at a height, the largest first."""
        if height not in self._sections:
            self._sections[height] = _regions(self.body.slice(height))
        return self._sections[height]

    def shadow(self, low: float, high: float) -> list[Region]:
        """Of what lies between two heights, as it is seen: connected pieces, the largest first."""
        between = self.body.trim_by_plane((0, 0, 1), low + _SAME_LEVEL).trim_by_plane(
            (0, 0, -1), _SAME_LEVEL - high
        )
        return _regions(between.project())

    @cached_property
    def silhouette(self) -> list[Region]:
        """Of the whole, as it is seen: connected pieces, the largest first."""
        return _regions(self.body.project())


def _regions(section: CrossSection) -> list[Region]:
    pieces = [Region(p, p.area()) for p in section.simplify(_ROUNDING).decompose()]
    return sorted((p for p in pieces if p.area > _SLIVER), key=lambda p: -p.area)


def _heights(height: np.ndarray, weight: np.ndarray, least: float) -> list[tuple[float, float]]:
    """Weight and mean of the heights (K,) that lie together and have more than the least weight."""
    found: list[tuple[float, float]] = []
    order = np.argsort(height)
    start = 0
    for i in range(1, len(order) + 1):
        if i == len(order) or height[order[i]] - height[order[i - 1]] > _SAME_LEVEL:
            group = order[start:i]
            total = float(weight[group].sum())
            if total > least:
                found.append((total, float(np.average(height[group], weights=weight[group]))))
            start = i
    return found


def profile_of(section: CrossSection) -> Profile | None:
    """Of a connected section, at the finest tolerance that does not follow every chord."""
    fine = _profile(section, FINE)
    if fine is None or len(fine.corners) <= _MANY:
        return fine
    coarse = _profile(section, COARSE)
    if coarse is not None and len(coarse.corners) <= _FEWER * len(fine.corners):
        return coarse
    return fine


def _profile(section: CrossSection, tolerance: float, mended: bool = False) -> Profile | None:
    """mended: whether slits and necks that the tolerance would close or cut are no more."""
    polygons = [np.asarray(p) for p in section.to_polygons()]
    if not polygons:
        return None
    polygons.sort(key=_loop_area, reverse=True)
    loops = [fitted_loop(p, tolerance) for p in polygons]
    if loops[0] is None:
        return None
    holes = [
        loop
        for loop, p in zip(loops[1:], polygons[1:], strict=True)
        if loop is not None and abs(_loop_area(p)) > _SLIVER
    ]
    outline, more = unpinched(loops[0], FINE)
    profile = _valid(outline, holes + more)
    if profile is None or not touches_itself(profile.loops, TOUCHING):
        return with_tangents(profile, FINE) if profile is not None else None
    tried = () if mended else without_slits(section, _SLIT * tolerance)
    simple = (_profile(one, tolerance, True) for one in tried)
    return next((one for one in simple if one is not None), None)


def _valid(outline: Loop, holes: Sequence[Loop]) -> Profile | None:
    try:
        return Profile(outline, tuple(holes))
    except ParameterError:
        return None


def _loop_area(polygon: np.ndarray) -> float:
    x, y = np.asarray(polygon, dtype=np.float64).T
    return float((x * following(y) - following(x) * y).sum() / 2)


def area_centre(polygons: Sequence[np.ndarray]) -> np.ndarray:
    """(2,) of the area within closed polygons (K, 2), holes the other way round."""
    a = np.concatenate([np.asarray(polygon, dtype=np.float64) for polygon in polygons])
    b = np.concatenate([following(np.asarray(polygon, dtype=np.float64)) for polygon in polygons])
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum()))
