"""Walls with a draft: sections that grow narrower, or wider, by the same on all sides as one goes along them.

A mould, or a casting, is drawn as one extrusion whose walls lean by a degree or a few; seen from the side it
would be trapezoids, and each pair of walls a part of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from partwright.approximation.profile_parts import extruded_part
from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.rods import MOST_REGIONS, span
from partwright.approximation.sketches.sections import FINE, Region, View, profile_of
from partwright.approximation.sketches.teeth import drawn_corners
from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields import Extrusion
from partwright.fields.profile import Profile
from partwright.fields.profile_growth import grown_profile
from partwright.meshing.csg import solid_of
from partwright.rows import following, lengths

_ENDS = (0.03, 0.97)  # of a slab, where its sections are compared
_LEAST = 1.5e-3  # unit lengths: walls that lean by less in all are upright
_STEEPEST = 15.0  # degrees
_STEPS = 6  # of Newton's, for how far a section is within another
_CORNERS = 0.45  # of that: corners that stay as round, or as sharp, are off by less, an upright wall by more
_WALLS = 0.05  # of that, by which walls are off on average: those of a hole may lean otherwise
_NEAR = 5e-4  # unit lengths, by which any wall may be off besides
_ABOVE = 1e-3  # unit lengths from the wide end, where the profile is read
_PLAIN = (1.0, 0.5, 0.25, 0.1, 0.05, 0.01)  # degrees, multiples of which are tried
_UNSEEN = 2e-4  # unit lengths, by which a wall's end may move for that
_MITRE = 4.0


def drafted(view: View, slabs: Sequence[tuple[float, float]], i: int, holes: bool) -> Iterator[Candidate]:
    """The regions of one slab as far as they go on with walls that lean as they do there, and with their
    holes closed, where these lean otherwise; only those of spans that do not begin in a thicker slab."""
    middles = [(low + high) / 2 for low, high in slabs]
    for region in view.regions(middles[i])[:MOST_REGIONS]:
        for section in [region.section, *([region.filled] if holes and region.has_holes else [])]:
            slope = slope_of(view, section, slabs[i])
            if slope is None:
                continue
            lean = _Lean(view, section, middles[i], slope)
            first, last = span(i, middles, lean.goes_on)
            thickest = max(range(first, last + 1), key=lambda k: slabs[k][1] - slabs[k][0])
            one = lean.candidate(slabs[first][0], slabs[last][1]) if thickest == i else None
            if one is not None:
                yield one


def leans(part: Part) -> bool:
    """Whether it has such walls."""
    return isinstance(part.field, Extrusion) and part.field.taper > 0


@dataclass(frozen=True)
class _Lean:
    """The section of a view at a height, and by how much its sides go inwards a length up."""

    view: View
    section: CrossSection
    height: float
    slope: float

    def at(self, height: float) -> CrossSection | None:
        """The section of the view at another height, if it is the one that these walls have there."""
        by = self.slope * (height - self.height)
        wanted = _within(self.section, by)
        found = (one for one in _alike(self.view, height, self.section) if _are_same(wanted, one, abs(by)))
        return None if wanted.is_empty() else next(found, None)

    def goes_on(self, height: float) -> bool:
        return self.at(height) is not None

    def candidate(self, low: float, high: float) -> Candidate | None:
        """None where its wide end is no profile, or one that has no room for the walls."""
        degrees = _plain(math.degrees(math.atan(abs(self.slope))), high - low)
        wide = self.at(low + _ABOVE if self.slope > 0 else high - _ABOVE)
        profile = None if wide is None else profile_of(wide)
        if profile is None:
            return None
        frame = self.view.frame
        if self.slope < 0:  # wider on the way up: as it stands on its head
            frame, profile = frame @ np.diag([1.0, -1.0, -1.0]), _mirrored(profile)
            low, high = -high, -low
        slope = math.tan(math.radians(degrees))

        def part(further: float) -> Part:
            return extruded_part(grown_profile(profile, slope * _ABOVE + further), frame, low, high, degrees)

        def make(further: float) -> Manifold:
            try:
                return solid_of(part(math.copysign(FINE, further) if further else 0.0), FINE)
            except ParameterError:  # a side would vanish
                return solid_of(own, FINE)

        try:
            own = part(0.0)
        except ParameterError:
            return None
        volume = self.section.area() * (high - low)
        return Candidate(own, make, drawn_corners(profile.loops) + 1, volume)


def slope_of(view: View, section: CrossSection, slab: tuple[float, float]) -> float | None:
    """By how much all walls of a slab lean inwards a length up; None where they are upright or differ, and of
    a cone, which is turned."""
    if Region(section, section.area()).is_round and section.num_contour() == 1:
        return None
    low, high = (slab[0] + share * (slab[1] - slab[0]) for share in _ENDS)
    below, above = (
        next((one for one in _alike(view, z, section) if not (one ^ section).is_empty()), None)
        for z in (low, high)
    )
    if below is None or above is None:
        return None
    wide, narrow = (below, above) if below.area() > above.area() else (above, below)
    depth = _depth(wide, narrow.area())
    steepest = math.tan(math.radians(_STEEPEST)) * (high - low)
    if not _LEAST < depth < steepest or not _are_same(_within(wide, depth), narrow, depth):
        return None
    return math.copysign(depth, below.area() - above.area()) / (high - low)


def _alike(view: View, height: float, section: CrossSection) -> Iterator[CrossSection]:
    """Regions at a height, their holes closed where the section has none."""
    for region in view.regions(height):
        yield region.section if section.num_contour() > 1 else region.filled


def _depth(section: CrossSection, area: float) -> float:
    """How far within a section one of a smaller area lies."""
    depth = 0.0
    for _ in range(_STEPS):
        inner = _within(section, depth)
        around = sum(_around(np.asarray(polygon)) for polygon in inner.to_polygons())
        if inner.is_empty() or not around:
            return math.inf
        depth += (inner.area() - area) / around
    return depth


def _around(polygon: np.ndarray) -> float:
    return float(lengths(following(polygon) - polygon).sum())


def _within(section: CrossSection, depth: float) -> CrossSection:
    return section.offset(-depth, JoinType.Miter, _MITRE)


def _are_same(one: CrossSection, other: CrossSection, depth: float) -> bool:
    """Whether no wall is off, corners being as they are where walls lean inwards by a depth."""
    at_corners = _CORNERS * abs(depth) + _NEAR
    if not all((a - _within(b, -at_corners)).is_empty() for a, b in ((one, other), (other, one))):
        return False
    around = sum(_around(np.asarray(polygon)) for polygon in one.to_polygons())
    return bool((one - other).area() + (other - one).area() < (_WALLS * abs(depth) + _NEAR / 2) * around)


def _plain(degrees: float, height: float) -> float:
    """The plainest angle that moves the end of a wall so high hardly more than can be seen."""
    for step in _PLAIN:
        near = round(degrees / step) * step
        moved = math.tan(math.radians(near)) - math.tan(math.radians(degrees))
        if near > 0 and abs(moved) * height < _UNSEEN:
            return round(near, 2)
    return degrees


def _mirrored(profile: Profile) -> Profile:
    """Across x."""
    return Profile.of_loops([tuple((x, -y, -bulge) for x, y, bulge in loop) for loop in profile.loops])
