"""Half sections of a body through an axis, turned about it: all around, or as far as they go on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold
from scipy.spatial import cKDTree

from partwright.approximation.profile_parts import revolved_part
from partwright.approximation.sketches.candidate import Candidate, posed
from partwright.approximation.sketches.sections import FINE, View, profile_of
from partwright.errors import ParameterError
from partwright.fields.profile import Corner, Loop, Profile

_OFFSET = 0.0137  # radians: no plane along faces
_PLANES = 4  # through an axis, for what goes all around
_BETWEEN = 3 * math.pi / 16 + _OFFSET  # of one more, beside holes that all of those may go through
_USUAL = 6  # of their eight halves, that have what is usual
_HALVES = 32  # half-planes at which partial turns are looked for
_FEWEST = 3  # of them, that a partial turn goes through
_BISECTIONS = 7  # of the angle between two, for where it ends
_ROUND = 0.4  # of what any half section has, that all have
_SAME = 0.03  # of the area
_LEAST = 4e-4  # unit areas
_MOST_PARTIAL = 4
_CORE = 2e-3  # unit lengths: so near to the axis is at it
_CROSSED = 1.3  # times the area that a cavity has along all planes, which a hole across has along some
_EVEN = 0.98  # of what any half section has, that all of them have
_WAVES = 4e-3  # unit lengths: waves of a mean half section, of which there are nine
_SNAP = 0.012
_DOMED = 3e-3  # unit lengths that an arc may move to become part of a sphere
_GRADUAL = 3.0  # times what is told apart, that a piece is off at most a little past a smooth end
_DRAWN = math.radians(15)  # the steps in which bends are drawn
_ABOUT = math.radians(4)  # how well smooth ends are told
_LONG = 20.0  # tolerances, that a line is long whose direction is told by them
_SKIN = 7e-4  # unit lengths: of what rounding leaves over a flat end


@dataclass(frozen=True)
class Axis:
    """Of a view, through `centre` (2,) along its z."""

    view: View
    centre: np.ndarray

    @cached_property
    def body(self) -> Manifold:
        return self.view.body.translate((-float(self.centre[0]), -float(self.centre[1]), 0.0))

    @cached_property
    def flat(self) -> np.ndarray:
        """(V, 2) distance from the axis and height of the mesh's vertices."""
        vertices = self.view.mesh[0] - (*self.centre, 0.0)
        return np.column_stack([np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]])

    @cached_property
    def tree(self) -> cKDTree:
        return cKDTree(self.flat)

    @cached_property
    def right(self) -> CrossSection:
        reach = 2 * float(np.abs(self.flat).max())
        corners = [(0.0, -reach), (reach, -reach), (reach, reach), (0.0, reach)]
        return CrossSection([corners], FillRule.Positive)

    def half(self, turn: float) -> CrossSection:
        """The half section at an angle: distance from the axis, and height."""
        return self._section(turn) ^ self.right

    def halves(self, turn: float) -> tuple[CrossSection, CrossSection]:
        """Half sections at an angle and half a turn beyond."""
        section = self._section(turn)
        return section ^ self.right, section.mirror((1.0, 0.0)) ^ self.right

    def _section(self, turn: float) -> CrossSection:
        c, s = math.cos(turn), math.sin(turn)
        # (x, y, z) to (distance along the plane, z, distance from it)
        plane = np.array([[c, s, 0, 0], [0, 0, 1, 0], [s, -c, 0, 0]], dtype=float)
        return self.body.transform(plane).slice(0.0)


def turned(view: View, centre: np.ndarray) -> Iterator[Candidate]:
    """What may be turned about an axis at `centre` (2,) of the view."""
    axis = Axis(view, centre)
    turns = np.arange(_PLANES) * (math.pi / _PLANES) + _OFFSET
    halves = [half for turn in turns for half in axis.halves(turn)]
    whole, shared = CrossSection(), halves[0]
    for half in halves:
        whole, shared = whole + half, shared ^ half
    whole = sum(axis.halves(_BETWEEN), whole)
    middle = sorted(halves, key=lambda half: half.area())[len(halves) // 2]
    if shared.area() <= _ROUND * whole.area():
        usual = _in_many(halves, _USUAL)  # without ribs, and with what a keyway and bolt holes take
        if usual.area() > _ROUND * middle.area():
            for region in usual.decompose():
                if region.area() > 0.05 * usual.area():
                    for one in _revolved(axis, region, 0.0, 2 * math.pi):
                        yield replace(one, usual=True)
        yield from _partly(axis)
        return
    solid = _solid_at_the_axis(whole)
    found = [middle, whole, shared]
    further = [_mean(axis)] if shared.area() < _EVEN * whole.area() else []
    if solid is not None and _is_crossed(solid, whole, shared):
        found, further = ([_solid_at_the_axis(half) or half for half in some] for some in (found, further))
    if solid is not None:
        further.append(solid)
    distinct: list[CrossSection] = []
    for half in found:
        alike = any((half - d).area() + (d - half).area() < _SAME * half.area() for d in distinct)
        if half.area() > _LEAST and not alike:
            distinct.append(half)
    for half in (*distinct, *further):
        for region in half.decompose():
            if region.area() > 0.05 * half.area():
                yield from _revolved(axis, region, 0.0, 2 * math.pi)


def _in_many(halves: Sequence[CrossSection], least: int) -> CrossSection:
    """What at least so many of half sections have."""
    covered = [CrossSection() for _ in range(least)]  # by one or more of those so far, by two or more, ...
    for half in halves:
        for k in range(least - 1, 0, -1):
            covered[k] = covered[k] + (covered[k - 1] ^ half)
        covered[0] = covered[0] + half
    return covered[-1]


def _mean(axis: Axis) -> CrossSection:
    """What most half sections have: of a thread, up to its mean diameter."""
    step = 2 * math.pi / 9
    halves = [axis.half(k * step + _OFFSET) for k in range(9)]
    thirds = [_most(*halves[k::3]) for k in range(3)]
    return _most(*thirds).simplify(_WAVES)


def _most(a: CrossSection, b: CrossSection, c: CrossSection) -> CrossSection:
    """What two of three have."""
    return (a ^ b) + (c ^ (a + b))


def _is_crossed(solid: CrossSection, whole: CrossSection, shared: CrossSection) -> bool:
    """Whether what is missing at the axis is a hole across it, which is wider along some planes through the
    axis than along others, and not a cavity that is turned about it, too."""
    hollow = solid - whole
    wider = [piece for piece in (solid - shared).decompose() if not (piece ^ hollow).is_empty()]
    return bool(sum(piece.area() for piece in wider) > _CROSSED * hollow.area())


def _solid_at_the_axis(half: CrossSection) -> CrossSection | None:
    """A half section without what is missing along the axis between two places where it reaches it: no plane
    through the axis passes by a hole that crosses it. None where nothing is."""
    if half.is_empty():
        return None
    low, high = float(half.bounds()[1]), float(half.bounds()[3])
    core = CrossSection([[(0.0, low), (_CORE, low), (_CORE, high), (0.0, high)]], FillRule.Positive)
    reached = sorted(
        float(v) for piece in (half ^ core).decompose() for v in (piece.bounds()[1], piece.bounds()[3])
    )
    filled = half
    for start, end in zip(reached[1:-1:2], reached[2::2], strict=True):
        reach = float(half.bounds()[2])
        below, above = start - 2 * _CORE, end + 2 * _CORE
        band = CrossSection([[(0.0, below), (reach, below), (reach, above), (0.0, above)]], FillRule.Positive)
        missing = [piece for piece in (band - half).decompose() if piece.bounds()[0] < _CORE]
        # What goes on to the outside is a groove, or the gap between two bodies.
        if end > start and missing and all(piece.bounds()[2] < reach - _CORE for piece in missing):
            filled = sum(missing, filled)
    return filled if filled is not half else None


def _partly(axis: Axis) -> Iterator[Candidate]:
    """Connected pieces of half sections, from the angle where they begin to that where they end."""
    step = 2 * math.pi / _HALVES
    both = [axis.halves(k * step + _OFFSET) for k in range(_HALVES // 2)]
    halves = [one for one, _ in both] + [other for _, other in both]
    found: list[tuple[CrossSection, int, int]] = []
    for k, half in enumerate(halves):
        for piece in half.decompose():
            if piece.area() < _LEAST or len(found) >= _MOST_PARTIAL:
                continue
            if any((k - a) % _HALVES <= b - a and _within(piece, known) for known, a, b in found):
                continue
            first = last = k
            while last - first < _HALVES and _within(piece, halves[(last + 1) % _HALVES]):
                last += 1
            while last - first < _HALVES and _within(piece, halves[(first - 1) % _HALVES]):
                first -= 1
            if last - first + 1 < _FEWEST:
                continue
            found.append((piece, first, last))
            if last - first >= _HALVES - 1:
                yield from _revolved(axis, piece, 0.0, 2 * math.pi)
                continue
            begin = _end(axis, piece, first * step + _OFFSET, -step)
            end = _end(axis, piece, last * step + _OFFSET, step)
            yield from _revolved(axis, piece, begin, end - begin)


def _within(piece: CrossSection, half: CrossSection, same: float = 2 * _SAME) -> bool:
    return bool((piece - half).area() < same * piece.area())


def _end(axis: Axis, piece: CrossSection, turn: float, step: float) -> float:
    """The angle between `turn`, where the piece is, and one step on, where it is not, at which it ends.

    A bend that goes over into a straight rod does so with the square of the angle: where it is off by a
    quarter of what is told apart, it is half as far past its end.
    """

    def last(start: float, stop: float, same: float) -> float:
        near, far = start, stop
        for _ in range(_BISECTIONS):
            middle = (near + far) / 2
            if _within(piece, axis.half(middle), same):
                near = middle
            else:
                far = middle
        return (near + far) / 2

    found = last(turn, turn + step, 2 * _SAME)
    if _within(piece, axis.half(found + step / 8), _GRADUAL * 2 * _SAME):
        earlier = last(found - 2 * step, found, _SAME / 2)
        smooth = 2 * earlier - found
        drawn = _DRAWN * round(smooth / _DRAWN)
        return drawn if abs(drawn - smooth) < _ABOUT else smooth
    whole = math.radians(round(math.degrees(found)))  # from the axis of the frame along which other parts lie
    return whole if abs(whole - found) < abs(step) * 2.0**-_BISECTIONS else found


def _revolved(axis: Axis, region: CrossSection, begin: float, angle: float) -> Iterator[Candidate]:
    """A piece of a half section from an angle on, radians."""
    half = _snapped(region, axis.flat, axis.tree)
    profile = profile_of(half) if half is not None else None
    if half is None or profile is None:
        return
    c, s = math.cos(begin), math.sin(begin)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    frame, degrees = axis.view.frame @ turn, min(math.degrees(angle), 360.0)
    foot = turn.T @ (*axis.centre, 0.0)
    try:
        part = revolved_part(_off_axis(profile), frame, foot, degrees)
    except ParameterError:
        return

    def make(further: float) -> Manifold:
        # Chords are off along the radius: what stands on a flat end is not to be parted from it. Of what lies
        # within, the ends are a little off even so, or skins over them would join pieces.
        out, in_ = (half.translate((by, 0.0)) for by in (further, -further))
        grown = half + out + in_ if further > 0 else half ^ out ^ in_
        if further < 0:
            grown = grown.scale((1e3, 1e3)).offset(-1e3 * _SKIN, JoinType.Miter, 2.0).scale((1e-3, 1e-3))
        body = Manifold.revolve(grown, 128, degrees)
        return posed(body.translate((float(foot[0]), float(foot[1]), 0.0)), frame)

    yield Candidate(part, make, len(profile.corners), half.area() * degrees)


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


def _off_axis(profile: Profile) -> Profile:
    """Corners near the axis on it, lines that are nearly along or across it so, and arcs that nearly meet it
    squarely about a centre on it."""
    loops = [_squared(tuple((0.0 if x < 2e-3 else x, y, b) for x, y, b in loop)) for loop in profile.loops]
    loops = [
        tuple(
            (x, y, _domed((x, y), then, b)) for (x, y, b), then in zip(loop, loop[1:] + loop[:1], strict=True)
        )
        for loop in loops
    ]
    return Profile.of_loops(loops)


def _squared(loop: Loop) -> Loop:
    """Lines along the axis and across it where they are so within the tolerance: a hole is no cone."""
    corners = np.array(loop)
    for i, j in pairwise([*range(len(loop)), 0]):
        for axis in (0, 1):
            start, end = corners[i, axis], corners[j, axis]
            long = abs(corners[j, 1 - axis] - corners[i, 1 - axis]) > _LONG * FINE
            if not corners[i, 2] and long and abs(end - start) < FINE:
                corners[[i, j], axis] = 0.0 if axis == 0 and 0 in (start, end) else (start + end) / 2
    return tuple((x, y, b) for x, y, b in corners.tolist())


def _domed(start: tuple[float, float], then: Corner, bulge: float) -> float:
    """The bulge of the arc that turns into part of a sphere, where it is the same within the tolerance."""
    (x, y), (u, v, _) = start, then
    if not bulge or min(x, u) > 0:
        return bulge
    # From a pole, a chord falls off the level by half of the angle that its arc spans.
    dome = math.copysign(math.tan(math.atan2(abs(v - y), max(x, u)) / 2), bulge)
    centre = (x + u) / 2 - (v - y) * (1 - dome * dome) / (4 * dome) if dome else math.inf
    on_axis = abs(centre) < 1e-9 * math.hypot(x - u, y - v)
    return dome if on_axis and abs(dome - bulge) * math.hypot(x - u, y - v) / 2 < _DOMED else bulge
