"""Parts that a closed body, or a piece of one, may be made of: sections extruded, half sections turned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold
from scipy.spatial import cKDTree

from partwright.approximation.profile_parts import extruded_part, revolved_part
from partwright.approximation.sketches.sections import Region, View, profile_of
from partwright.assembly import Part
from partwright.errors import ParameterError
from partwright.fields.profile import Profile

_INSIDE = 0.02  # of a section: what of it may lie outside of the next slab's, and it still goes on
_MOST_REGIONS = 4  # of a section
_LEAST_SHARE = 0.01  # of the largest region's area
_CHORDS = 4e-3  # unit lengths
_TURNS = 4  # planes through an axis
_AXES = 2
_LEAST_AXIS = 0.2  # of the area of all walls, that those about an axis have
_NEAR_AXIS = 4e-3
_SNAP = 0.012
_ROUND = 0.4  # of what any half section has, that all have
_MOST_SLABS = 10


@dataclass(frozen=True)
class Candidate:
    """A part, and what makes the same body with the mesh's own walls, chords and all.

    make: the body, further out by a length where its walls are not the mesh's own. sides: of its profile.
    volume: tells candidates apart.
    """

    part: Part
    make: Callable[[float], Manifold]
    sides: int
    volume: float

    @cached_property
    def bodies(self) -> tuple[Manifold, Manifold]:
        """Within the part's surface and around it, by as little as chords are off it."""
        return self.make(-_CHORDS), self.make(_CHORDS)

    @cached_property
    def key(self) -> tuple[float, ...]:
        """The same for candidates that are the same."""
        return tuple(np.round([*self.part.bounds().ravel(), self.volume], 3).tolist())


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


def _extrusions(view: View, holes: bool) -> Iterator[Candidate]:
    """Each connected piece of a section as far up and down as it goes on."""
    slabs = list(view.slabs)
    middles = [(low + high) / 2 for low, high in slabs]
    thick = sorted(range(len(slabs)), key=lambda i: slabs[i][0] - slabs[i][1])[:_MOST_SLABS]
    done: set[tuple[int, int, int]] = set()
    for i in sorted(thick):
        z = middles[i]
        regions = view.regions(z)[:_MOST_REGIONS]
        for region in regions:
            if region.area < _LEAST_SHARE * regions[0].area:
                continue
            first = last = i
            while first > 0 and _goes_on(region, view.regions(middles[first - 1])):
                first -= 1
            while last + 1 < len(slabs) and _goes_on(region, view.regions(middles[last + 1])):
                last += 1
            spans = {(first, last), (i, i)}
            for a, b in spans:
                key = (a, b, round(region.area * 1e5))
                if key not in done:
                    done.add(key)
                    yield from _extruded(view, region, slabs[a][0], slabs[b][1], holes)


def _goes_on(region: Region, others: Sequence[Region]) -> bool:
    left = region.section
    for other in others:
        left = left - other.section
        if left.is_empty():
            return True
    return bool(left.area() < _INSIDE * region.area)


def _extruded(view: View, region: Region, low: float, high: float, holes: bool) -> Iterator[Candidate]:
    for section in (
        (region.section, region.filled) if holes and region.section.num_contour() > 1 else (region.section,)
    ):
        profile = region.profile if section is region.section else profile_of(section)
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

    def make(_: float) -> Manifold:
        return _turned(Manifold.extrude(section, high - low).translate((0, 0, low)), frame)

    return Candidate(part, make, len(profile.corners), section.area() * (high - low))


def _turned(body: Manifold, frame: np.ndarray) -> Manifold:
    return body.transform(np.column_stack([frame, np.zeros(3)]))


def _revolutions(view: View) -> Iterator[Candidate]:
    """About the axes of the arcs in its sections."""
    for centre in _axes(view):
        yield from turned(view, centre)


def _axes(view: View) -> list[np.ndarray]:
    """Centres (2,) that the most length of arcs times the height of their slab is about."""
    votes: list[tuple[float, np.ndarray]] = []
    straight = 0.0
    for low, high in view.slabs:
        for region in view.regions((low + high) / 2)[:_MOST_REGIONS]:
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
    return [centre for weight, centre in best if weight > least]


def turned(view: View, centre: np.ndarray) -> Iterator[Candidate]:
    """Half sections through an axis at `centre` of the view, all around."""
    body = view.body.translate((-float(centre[0]), -float(centre[1]), 0.0))
    vertices = view.mesh[0] - (centre[0], centre[1], 0.0)
    flat = np.column_stack([np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]])
    tree, reach = cKDTree(flat), float(flat.max()) + float(np.abs(flat).max())
    right = CrossSection([[(0, -reach), (reach, -reach), (reach, reach), (0, reach)]], FillRule.Positive)
    halves: list[CrossSection] = []
    for turn in np.arange(_TURNS) * (math.pi / _TURNS) + 0.0137:
        c, s = math.cos(turn), math.sin(turn)
        # (x, y, z) to (distance along the plane, z, distance from it)
        plane = np.array([[c, s, 0, 0], [0, 0, 1, 0], [s, -c, 0, 0]], dtype=float)
        section = body.transform(plane).slice(0.0)
        halves += [section ^ right, section.mirror((1.0, 0.0)) ^ right]
    halves = [h for h in halves if not h.is_empty()]
    if not halves:
        return
    whole, shared = CrossSection(), halves[0]
    for half in halves:
        whole, shared = whole + half, shared ^ half
    if shared.area() < _ROUND * whole.area():
        return
    middle = sorted(halves, key=lambda half: half.area())[len(halves) // 2]
    distinct: list[CrossSection] = []
    for half in (middle, whole, shared):
        area = half.area()
        if area > 1e-4 and not any((half - d).area() + (d - half).area() < 0.03 * area for d in distinct):
            distinct.append(half)
    for half in distinct:
        for region in half.decompose():
            if region.area() < 0.05 * half.area():
                continue
            snapped = _snapped(region, flat, tree)
            one = revolution(snapped, view.frame, centre) if snapped is not None else None
            if one is not None:
                yield one


def _snapped(half: CrossSection, flat: np.ndarray, tree: cKDTree) -> CrossSection | None:
    """With corners where the mesh's vertices are: a cut through chords lies within the surface."""
    polygons = []
    for polygon in half.to_polygons():
        points = np.asarray(polygon, dtype=np.float64)
        off, index = tree.query(points)
        near = off < _SNAP * np.maximum(points[:, 0], 0.2)
        points[near] = flat[index[near]]
        points[np.abs(points[:, 0]) < 2e-3, 0] = 0.0
        polygons.append(points)
    snapped = CrossSection(polygons, FillRule.NonZero)
    pieces = sorted(snapped.decompose(), key=lambda p: -p.area())
    return pieces[0] if pieces else None


def revolution(half: CrossSection, frame: np.ndarray, centre: np.ndarray) -> Candidate | None:
    profile = profile_of(half)
    if profile is None:
        return None
    try:
        part = revolved_part(_off_axis(profile), frame, np.array([centre[0], centre[1], 0.0]))
    except ParameterError:
        return None

    def make(further: float) -> Manifold:
        grown = half.scale((1e3, 1e3)).offset(1e3 * further, JoinType.Miter, 2.0)
        body = Manifold.revolve(grown, 128).scale((1e-3,) * 3)
        return _turned(body.translate((float(centre[0]), float(centre[1]), 0.0)), frame)

    return Candidate(part, make, len(profile.corners), half.area())


def _off_axis(profile: Profile) -> Profile:
    """Corners near the axis on it."""
    loops = [tuple((0.0 if x < 2e-3 else x, y, b) for x, y, b in loop) for loop in profile.loops]
    return Profile(loops[0], tuple(loops[1:]))
