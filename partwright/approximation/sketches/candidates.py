"""Parts that a closed body, or a piece of one, may be made of: sections extruded, half sections turned."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from partwright.approximation.profile_parts import extruded_part
from partwright.approximation.sketches.candidate import Candidate, posed
from partwright.approximation.sketches.drafts import drafted, slope_of
from partwright.approximation.sketches.holes import hole_parts
from partwright.approximation.sketches.rims import SHARP, bottom_rim, limited, rimmed_body, top_rim
from partwright.approximation.sketches.rods import (
    ELSEWHERE,
    MOST_REGIONS,
    SAME_AREA,
    goes_on,
    is_rod,
    rod,
    round_at_ends,
    span,
)
from partwright.approximation.sketches.sections import FINE, Region, View, area_centre
from partwright.approximation.sketches.teeth import drawn_corners
from partwright.approximation.sketches.turned import turned
from partwright.errors import ParameterError
from partwright.fields.profile import Profile, circle_of
from partwright.fields.rims import Rim

_LEAST_SHARE = 0.01  # of the largest region's area
_AXES = 2
_LEAST_AXIS = 0.2  # of the area of all walls, that those about an axis have
_NEAR_AXIS = 4e-3
_BALANCED = 0.98  # of the largest second moment of a section's area, that the least has
_MOST_SLABS = 10
_ALL_RIM = 0.95  # of a slab's height
_ENGRAVED = 16  # corners of a section, from which on what cut it may not be its own
_PLAINER = 0.8  # of them, that the slab as it is seen has at most


def candidates(body: Manifold, frames: Sequence[np.ndarray], holes: bool) -> list[Candidate]:
    """Of a body, along each frame; none twice. holes: also what closes the holes of sections."""
    found: dict[tuple[float, ...], Candidate] = {}
    for frame in frames if not body.is_empty() else ():
        view = View.along(body, frame)
        for one in (*_extrusions(view, holes), *_revolutions(view)):
            known = found.get(one.key)
            if known is None or one.sides < known.sides:
                found[one.key] = one
    return list(found.values())


def silhouettes(body: Manifold, frames: Sequence[np.ndarray]) -> list[Candidate]:
    """What a body is cut from: as it is seen along each frame, from end to end; none twice, and none of a
    body that is in pieces there."""
    found: dict[tuple[float, ...], Candidate] = {}
    for frame in frames if not body.is_empty() else ():
        view = View.along(body, frame)
        seen = view.silhouette
        if len(seen) == 1:
            low, high = view.levels[0], view.levels[-1]
            for one in (
                *_extruded(view, seen[0].outlines(True), low, high),
                *_rounded(view, seen[0], [(low, high)], 0, 0, True),
            ):
                found.setdefault(one.key, one)
    return list(found.values())


def _extrusions(view: View, holes: bool) -> Iterator[Candidate]:
    """Each connected piece of a section as far up and down as it goes on."""
    slabs = list(view.slabs)
    middles = [(low + high) / 2 for low, high in slabs]
    thick = sorted(range(len(slabs)), key=lambda i: slabs[i][0] - slabs[i][1])[:_MOST_SLABS]
    done: set[tuple[int, int, int]] = set()
    for i in sorted(thick):
        by_itself = list(round_at_ends(view, *slabs[i]))
        yield from drafted(view, slabs, i, holes)
        for region in _regions(view, *slabs[i]):
            spans = {span(i, middles, partial(_goes_on_at, view, region)), (i, i)}
            if region.is_round and all(goes_on(o, [region]) for m in middles for o in view.regions(m)):
                spans.add((0, len(slabs) - 1))  # the ends of a hole through a round wall are not flat
            upright = [one for one in region.outlines(holes) if slope_of(view, one[0], slabs[i]) is None]
            for a, b in spans:
                key = (a, b, round(region.area * 1e5))
                if key not in done:
                    done.add(key)
                    yield from _extruded(view, upright, slabs[a][0], slabs[b][1])
                    yield from _rounded(view, region, slabs, a, b, holes)
            if region.is_round or is_rod(region, *slabs[i]):
                by_itself.append((region, (middles[i], middles[i])))
        for region, heights in by_itself:
            reach = rod(view, region, slabs, i, heights)
            if reach is not None:
                yield from _extruded(view, region.outlines(holes), *reach)
    seen = view.silhouette
    if len(seen) == 1 and seen[0].is_round:  # of what a drill leaves where it comes through a round wall
        yield from _extruded(view, seen[0].outlines(False), slabs[0][0], slabs[-1][1])


def _goes_on_at(view: View, region: Region, height: float) -> bool:
    return goes_on(region, view.regions(height))


def _regions(view: View, low: float, high: float) -> Iterator[Region]:
    """Of a slab: those in its middle, and others elsewhere in it that hold these, where a hole across it has
    cut the middle, or plainer ones within these, where what goes across has widened it; where letters that
    are engraved in its walls have cut it, all of it as it is seen."""
    middle = view.regions((low + high) / 2)[:MOST_REGIONS]
    found = [region for region in middle if region.area >= _LEAST_SHARE * middle[0].area]
    for share in ELSEWHERE:
        for region in view.regions(low + share * (high - low))[:1]:
            larger = not any(region.area < (1 + SAME_AREA) * other.area for other in middle)
            if larger and all(goes_on(other, [region]) for other in middle):
                found.append(region)
    yield from found
    largest = max(found, key=lambda region: region.area, default=None)
    if largest is None:
        return
    yield from _narrower(view, low, high, largest)
    if _corners(largest) > _ENGRAVED:
        for region in view.shadow(low, high)[:1]:
            if 0 < _corners(region) < _PLAINER * _corners(largest) and goes_on(largest, [region]):
                yield region


def _narrower(view: View, low: float, high: float, middle: Region) -> Iterator[Region]:
    """The region near both ends of a slab that lies within that of its middle and is plainer, if there is
    such."""
    below, above = (view.regions(low + share * (high - low))[:1] for share in ELSEWHERE)
    for region in below:
        is_less = region.area < (1 - SAME_AREA) * middle.area and _corners(region) < _corners(middle)
        if is_less and goes_on(region, above) and goes_on(region, [middle]):
            yield region


def _corners(region: Region) -> int:
    return len(region.profile.corners) if region.profile is not None else 0


def _extruded(
    view: View, outlines: Iterable[tuple[CrossSection, Profile | None]], low: float, high: float
) -> Iterator[Candidate]:
    for section, profile in outlines:
        one = extrusion(section, profile, view.frame, low, high)
        if one is not None:
            yield one


def extrusion(
    section: CrossSection, profile: Profile | None, frame: np.ndarray, low: float, high: float
) -> Candidate | None:
    """A section of the frame's view from one height to another."""
    if profile is None or high - low < 1e-4:
        return None
    part = extruded_part(profile, frame, low, high)
    is_round = circle_of(profile.outline) is not None

    def make(further: float) -> Manifold:
        # Elsewhere along a round wall the chords may be others, and would leave a skin that joins pieces.
        by = math.copysign(FINE, further) if is_round and further else 0.0
        grown = section.offset(by, JoinType.Miter, 2.0) if by else section
        return posed(Manifold.extrude(grown, high - low).translate((0, 0, low)), frame)

    return Candidate(part, make, drawn_corners(profile.loops), section.area() * (high - low))


def _rounded(
    view: View, region: Region, slabs: list[tuple[float, float]], first: int, last: int, holes: bool
) -> Iterator[Candidate]:
    """With the rims that the surface has there: at levels, or a slab further on, which then is all rim."""
    lows = [slabs[i][0] for i in (first, first - 1) if i >= 0]
    highs = [slabs[i][1] for i in (last, last + 1) if i < len(slabs)]
    for section, profile in region.outlines(holes):
        if profile is None:
            continue
        bottoms = [(low, bottom_rim(view.leaning, profile, low)) for low in lows]
        tops = [(high, top_rim(view.leaning, profile, high)) for high in highs]
        for (low, under), (high, over) in product(bottoms, tops):
            bottom, top = limited((under, over), profile, high - low)
            further = (lows[0] - low, high - highs[0])
            if all(rim.depth >= _ALL_RIM * more for rim, more in zip((bottom, top), further, strict=True)):
                rimmed = _with_rims(section, profile, view.frame, low, high, (bottom, top))
                if rimmed is not None:
                    yield rimmed
                    if section is not region.section:
                        yield from _drilled(rimmed, view, region, low, high)


def _drilled(solid: Candidate, view: View, region: Region, low: float, high: float) -> Iterator[Candidate]:
    """What stands on the region with its holes closed, with the holes cut from it."""
    if region.profile is None:
        return

    def make(further: float) -> Manifold:
        upright = Manifold.extrude(region.section, high - low).translate((0, 0, low))
        return solid.make(further) ^ posed(upright, view.frame)

    cuts = hole_parts(extruded_part(region.profile, view.frame, low, high, rims=(SHARP, SHARP)))
    sides = len(region.profile.corners) + sum(rim != SHARP for rim in solid.rims)
    yield replace(solid, make=make, sides=sides, volume=region.area * (high - low), cuts=cuts)


def _with_rims(
    section: CrossSection,
    profile: Profile,
    frame: np.ndarray,
    low: float,
    high: float,
    rims: tuple[Rim, Rim],
) -> Candidate | None:
    """As `extrusion`, with rims; none where they are sharp, or the profile has no room for them."""
    if rims == (SHARP, SHARP):
        return None
    try:
        part = extruded_part(profile, frame, low, high, rims=rims)
    except ParameterError:
        return None

    def make(further: float) -> Manifold:
        return posed(rimmed_body(section, rims, high - low, further > 0).translate((0, 0, low)), frame)

    sides = len(profile.corners) + sum(rim != SHARP for rim in rims)
    return Candidate(part, make, sides, section.area() * (high - low), rims)


def _revolutions(view: View) -> Iterator[Candidate]:
    """About the axes of the arcs in its sections."""
    for centre in _axes(view):
        yield from turned(view, centre)


def _axes(view: View) -> list[np.ndarray]:
    """Centres (2,) that the most length of arcs times the height of their slab is about."""
    votes: list[tuple[float, np.ndarray]] = []
    straight = 0.0
    for low, high in view.slabs:
        for region in view.regions((low + high) / 2)[:MOST_REGIONS]:
            profile = region.profile
            for side in (side for loop in profile.sides for side in loop) if profile else ():
                if side.centre is None:
                    straight += math.dist(side.start, side.end) * (high - low)
                elif abs(side.sweep) > 0.3:
                    weight = abs(side.sweep) * side.radius * (high - low)
                    votes.append((weight, np.array(side.centre)))
    found: list[tuple[float, np.ndarray]] = []
    left = sorted(votes, key=lambda v: -v[0])
    while left and len(found) < 3 * _AXES:
        middle = left[0][1]
        near = [v for v in left if math.dist(v[1], middle) < _NEAR_AXIS]
        left = [v for v in left if math.dist(v[1], middle) >= _NEAR_AXIS]
        total = sum(w for w, _ in near)
        found.append((total, sum((w * c for w, c in near), np.zeros(2)) / total))
    least = _LEAST_AXIS * (straight + sum(weight for weight, _ in votes))
    best = sorted(found, key=lambda f: -f[0])[:_AXES]
    axes = [centre for weight, centre in best if weight > least]
    sections = [view.regions((low + high) / 2)[:1] for low, high in view.slabs]
    largest = max((r for found in sections for r in found), key=lambda r: r.area, default=None)
    about = _balance(largest) if largest is not None else None
    if about is not None and all(math.dist(about, centre) > _NEAR_AXIS for centre in axes):
        axes.append(about)
    return axes


def _balance(region: Region) -> np.ndarray | None:
    """The centre (2,) of a section that is as long in any direction: of a gear. None of others."""
    polygons = region.section.to_polygons()
    centre = area_centre(polygons)
    loops = [np.asarray(polygon, dtype=np.float64) - centre for polygon in polygons]
    a, b = np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    both = np.einsum("ni,nj->nij", a, a) + np.einsum("ni,nj->nij", b, b)
    both = both + (np.einsum("ni,nj->nij", a, b) + np.einsum("ni,nj->nij", b, a)) / 2
    short, long = np.linalg.eigvalsh((both * cross[:, None, None]).sum(axis=0) / 12)
    return np.asarray(centre) if short > _BALANCED * long else None
