"""Outlines that are the same after a part of a turn: a circle and one tooth, or one gap, again and again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from manifold3d import CrossSection
from numpy.typing import NDArray

from partwright.approximation.sketches.chains import circle_through
from partwright.approximation.sketches.outlines import fitted_loop
from partwright.approximation.sketches.sections import FINE, area_centre
from partwright.assembly import Similarity
from partwright.errors import ParameterError
from partwright.fields.profile import Loop, Profile, circle

Floats = NDArray[np.float64]

FEATURE = 25
"""Corners of an outline that cost as much as one more feature."""
_LEAST = 16  # sides of a loop that may save some
_CHORD = FINE / 50
_NEAR = 1.5 * FINE  # unit lengths: how far a circle is moved off arcs, that no slivers are left along them
_ON_CIRCLE = _NEAR / 4
_ANGLES, _POINTS = 2048, 8192
_ORDERS = range(5, 201)
_ALIKE = 0.04  # of the ring of teeth: area that a turn may change
_TRIED = 0.5, 0.25, 0.75  # of all teeth by their area: which ones
_PIECE = 0.5  # of the largest piece's area: others are none
_BEYOND = 0.05  # of a tooth's height, that it reaches into what it stands on
_STEEP = 0.5  # cosine of the angle to the radius, of flanks that go on as they are


@dataclass(frozen=True)
class Teeth:
    """A profile as `base`, and one tooth there `order` times about a centre (2,).

    added: whether the tooth joins the profile, or is cut from it.
    """

    base: Profile
    tooth: Profile
    centre: tuple[float, float]
    order: int
    added: bool

    @property
    def moves(self) -> list[Similarity]:
        """To the other teeth, in the plane of the profile."""
        x, y = self.centre
        return [
            Similarity.turn((0, 0, 1), 2 * math.pi * k / self.order, (x, y, 0)) for k in range(1, self.order)
        ]


def toothed(profile: Profile) -> Iterator[Teeth]:
    """Each way to make the profile of one with a circle in the place of a loop, and teeth or gaps there."""
    for i, loop in enumerate(profile.loops):
        if len(loop) < _LEAST:
            continue
        line, centre = _centred(loop, _CHORD)
        order = _order(line)
        if order is None:
            continue
        x, y = centre.tolist()
        for outward, (radius, tooth) in (
            (way, one) for way in (True, False) for one in _teeth(line, order, way)
        ):
            loops = [*profile.loops]
            loops[i] = circle(radius, (x, y))
            try:
                base = Profile.of_loops(loops)
                yield Teeth(base, Profile(tooth).moved((x, y)), (x, y), order, outward is (i == 0))
            except ParameterError:  # the circle crosses another loop
                continue


def drawn_corners(loops: Iterable[Loop]) -> int:
    """Corners that loops are drawn with: each as it is, or, where it is a wheel, a circle's and one tooth's,
    and `FEATURE` for being one feature more."""
    return sum(map(_drawn, loops))


@lru_cache(maxsize=512)
def _drawn(loop: Loop) -> int:
    if len(loop) < FEATURE + _LEAST:
        return len(loop)
    order = _order(_centred(loop, FINE)[0])
    return len(loop) if order is None else min(len(loop), 2 + FEATURE + round(len(loop) / order))


def _centred(loop: Loop, chord: float) -> tuple[Floats, Floats]:
    """A closed line (K, 2) about the centre (2,) of the area within; how far its chords may be off."""
    line = Profile(loop).polylines(chord)[0]
    centre = area_centre([line])
    return line - centre, centre


def _order(line: Floats) -> int | None:
    """How many times a closed line (K, 2) is the same in one turn about the origin."""
    closed = np.vstack([line, line[:1]])
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1)))
    at = np.linspace(0.0, length[-1], _POINTS, endpoint=False)
    x, y = (np.interp(at, length, column) for column in closed.T)
    place = ((np.arctan2(y, x) / (2 * math.pi) + 1) % 1 * _ANGLES).astype(int) % _ANGLES
    reach = np.zeros(_ANGLES)
    np.maximum.at(reach, place, np.hypot(x, y))
    seen = np.flatnonzero(reach)
    reach = np.interp(np.arange(_ANGLES), seen, reach[seen], period=_ANGLES)
    strength = np.abs(np.fft.rfft(reach))
    strongest = max(_ORDERS, key=lambda n: float(strength[n]))
    radius = np.linalg.norm(line, axis=1)
    ring = math.pi * float(radius.max() ** 2 - radius.min() ** 2)
    whole = CrossSection([line])

    def is_symmetric(order: int) -> bool:
        both = (whole ^ whole.rotate(360 / order)).area()
        return 2 * (whole.area() - both) < _ALIKE * ring

    orders = (strongest // k for k in (1, 2, 3) if strongest % k == 0)
    return next((n for n in orders if n in _ORDERS and is_symmetric(n)), None)


def _teeth(line: Floats, order: int, outward: bool) -> Iterator[tuple[float, Loop]]:
    """Radius of the circle at the roots of the teeth of a closed line about the origin, and each of a few of
    the teeth; of the gaps between them, which stand on the circle of the tips, where not outward."""
    radius = np.linalg.norm(line, axis=1)
    root = float(radius.min() if outward else radius.max())
    near = root + _NEAR if outward else root - _NEAR
    disc = CrossSection.circle(near, math.ceil(2 * math.pi / math.acos(1 - _CHORD / near)))
    whole = CrossSection([line])
    pieces = (whole - disc if outward else disc - whole).decompose()
    largest = max((piece.area() for piece in pieces), default=0.0)
    pieces = sorted((p for p in pieces if p.area() > _PIECE * largest), key=lambda piece: piece.area())
    if len(pieces) != order:
        return
    further = _NEAR + _BEYOND * float(np.ptp(radius))
    for share in _TRIED:
        piece = np.asarray(pieces[int(share * order)].to_polygons()[0], dtype=np.float64)
        chain = _flanks(piece, near)
        tooth = None if chain is None else _closed(chain, root, further, outward)
        if tooth is not None:
            yield root, tooth


def _closed(chain: Floats, root: float, further: float, outward: bool) -> Loop | None:
    """A tooth whose flanks (K, 2) stand on a circle about the origin, into which it reaches; a full circle
    where it is of one."""
    middles = (chain[1:] + chain[:-1]) / 2
    middle, radius, off = circle_through(np.vstack([chain, middles]))
    if off < FINE and radius < root:
        return circle(radius, (float(middle[0]), float(middle[1])))
    first, last = chain[0], chain[-1]
    half = math.acos(min(1.0, float(first @ last) / float(np.linalg.norm(first) * np.linalg.norm(last)))) / 2
    beyond = root - further if outward else root / math.cos(half) + further
    ends = _further(first, first - chain[1], beyond), _further(last, last - chain[-2], beyond)
    return fitted_loop(np.vstack([ends[0], chain, ends[1]]), FINE)


def _flanks(piece: Floats, near: float) -> Floats | None:
    """The closed line (K, 2) from where it leaves a circle about the origin to where it comes back."""
    on_circle = np.abs(np.linalg.norm(piece, axis=1) - near) < _ON_CIRCLE
    leaving = np.flatnonzero(on_circle & ~np.roll(on_circle, -1))
    if len(leaving) != 1:
        return None
    piece, on_circle = (np.roll(values, -int(leaving[0]), axis=0) for values in (piece, on_circle))
    chain = piece[: int(np.flatnonzero(on_circle[1:])[0]) + 2]
    return chain if len(chain) > 2 else None


def _further(end: Floats, way: Floats, radius: float) -> Floats:
    """From an end (2,) on to a circle about the origin: as a flank goes, or, where it is flat, straight."""
    sign = math.copysign(1.0, radius - float(np.linalg.norm(end)))
    straight = sign * end / np.linalg.norm(end)
    way = way / np.linalg.norm(way)
    along = float(end @ way)
    square = along**2 - float(end @ end) + radius**2
    if float(way @ straight) < _STEEP or square < 0:
        return np.asarray(end + straight * abs(radius - float(np.linalg.norm(end))))
    return np.asarray(end + way * (-along + sign * math.sqrt(square)))
