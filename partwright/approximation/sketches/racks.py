"""Outlines with sides that come again along a line: a body and one fin, or one gap, in a row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.sections import FINE
from partwright.assembly import Similarity
from partwright.errors import ParameterError
from partwright.fields.profile import Loop, Profile, loop_of

Floats = NDArray[np.float64]

_LEAST = 16  # sides of a loop that may save some
_FEWEST = 4  # fins of a row
_LONGEST = 24  # sides of a fin
_NEAR = 2 * FINE  # unit lengths: how far corners may be off the row
_BULGE = 0.02  # by which bulges of one side may differ
_BEYOND = 0.05  # of a fin's height, that it reaches into what it stands on
_STEEP = 0.5  # sine of the angle to the row, of flanks that go on as they are
_SPREAD = 0.01  # the cosine, of flanks of a fin that is wider below


@dataclass(frozen=True)
class Rack:
    """A profile as `base`, and one fin there `count` times, a step (2,) apart.

    added: whether the fin joins the profile, or is cut from it.
    """

    base: Profile
    tooth: Profile
    step: tuple[float, float]
    count: int
    added: bool

    @property
    def moves(self) -> list[Similarity]:
        """To the other fins, in the plane of the profile."""
        x, y = self.step
        return [Similarity(translation=(k * x, k * y, 0.0)) for k in range(1, self.count)]


def racked(profile: Profile) -> Iterator[Rack]:
    """Each way to make the profile of one with a straight side in the place of a row, and fins or gaps."""
    for i, loop in enumerate(profile.loops):
        corners = np.array(loop)
        for period in range(2, min(len(loop) // 3, _LONGEST) + 1 if len(loop) >= _LEAST else 0):
            for chain in _runs(corners, period):
                for row in _rows(chain, period):
                    loops = [*profile.loops]
                    try:
                        loops[i] = _straight([*row.ends, *_rest(corners, chain, row)])
                        base = Profile.of_loops(loops)
                        yield Rack(base, Profile(row.tooth), row.step, row.count, row.added)
                    except ParameterError:  # the straight side crosses another
                        continue


@dataclass(frozen=True)
class _Run:
    """Corners (M, 3) in order, of which each is the one a period before it, a step (2,) further; the index of
    the first in its loop."""

    first: int
    corners: Floats
    step: Floats


@dataclass(frozen=True)
class _Row:
    """Fins of a run of corners: those from `first` to `last` are theirs. ends: the straight side below."""

    first: int
    last: int
    ends: tuple[Floats, Floats]
    tooth: Loop
    step: tuple[float, float]
    count: int
    added: bool


def _runs(corners: Floats, period: int) -> Iterator[_Run]:
    """The runs of a loop (K, 3) that hold enough fins of so many sides."""
    count = len(corners)
    ways = np.roll(corners, -period, axis=0)[:, :2] - corners[:, :2]
    alike = np.abs(np.roll(corners, -period, axis=0)[:, 2] - corners[:, 2]) < _BULGE
    goes_on = (np.abs(np.roll(ways, -1, axis=0) - ways).max(axis=1) < _NEAR) & alike
    for start in np.flatnonzero(goes_on & ~np.roll(goes_on, 1)).tolist():
        length = 1
        while goes_on[(start + length - 1) % count] and length < count:
            length += 1
        indices = (start + np.arange(min(length + period, count))) % count
        if len(indices) >= _FEWEST * period:
            step = ways[indices[:length]].mean(axis=0)
            if np.linalg.norm(step) > _NEAR:
                yield _Run(start, corners[indices], step)


def _rows(run: _Run, period: int) -> Iterator[_Row]:
    """Those fins that stand on a straight side: one touches the next, or a flat side lies between."""
    way = run.step / np.linalg.norm(run.step)
    for first in range(period):
        for sides in (period, period - 1):
            count = (len(run.corners) - 1 - sides - first) // period + 1
            if sides < 2 or count < _FEWEST:
                continue
            index = first + period * np.arange(count)[:, None] + np.arange(sides + 1)
            step = (run.corners[index[-1, 0], :2] - run.corners[index[0, 0], :2]) / (count - 1)
            own = run.corners[index]
            own[..., :2] -= np.arange(count)[:, None, None] * step
            fin = own.mean(axis=0)
            height = _across(way, fin[:, :2] - fin[0, :2])
            is_flat = sides == period or not run.corners[index[:-1, -1], 2].any()
            inner = height[1:-1]
            if not is_flat or abs(height[-1]) > _NEAR or np.abs(inner).min() < _NEAR:
                continue
            if (np.sign(inner) != np.sign(inner[0])).any():
                continue
            ends = fin[0].copy(), fin[-1] + (*((count - 1) * step), 0.0)
            ends[0][2] = 0.0
            ends[1][2] = run.corners[index[-1, -1], 2]
            added = bool(inner[0] < 0)  # the solid lies on the left
            x, y = step.tolist()
            tooth = _closed(fin, way, float(np.abs(inner).max()), 1.0 if added else -1.0)
            yield _Row(first, int(index[-1, -1]), ends, tooth, (x, y), count, added)


def _across(way: Floats, offsets: Floats) -> Floats:
    """(N,) of offsets (N, 2): how far to the left of a direction."""
    return np.asarray(way[0] * offsets[:, 1] - way[1] * offsets[:, 0])


def _closed(fin: Floats, way: Floats, height: float, side: float) -> Loop:
    """A fin of corners (S + 1, 3) as a loop that goes on a little below the side that it stands on.

    side: 1 where that is to the left of the row, -1 to the right.
    """
    down = side * np.array([-way[1], way[0]])
    first, last = fin[0, :2], fin[-1, :2]
    ways = (first - fin[1, :2], fin[0, 2]), (last - fin[-2, :2], fin[-2, 2])
    depth = _BEYOND * height
    ends: list[Floats] = []
    steep = []
    for end, (flank, bulge), inward in zip((first, last), ways, (way, -way), strict=True):
        flank = flank / np.linalg.norm(flank)
        spreads = side > 0 and float(flank @ inward) < -_SPREAD  # beyond what it stands on, at an end
        steep.append(bulge == 0.0 and float(flank @ down) > _STEEP and not spreads)
        ends.append(end + (flank / float(flank @ down) if steep[-1] else down) * depth)
    corners = [*fin[1:-1]]
    if not steep[0]:
        corners.insert(0, fin[0])
    if not steep[1]:
        corners.append(np.array([*last, 0.0]))
    return loop_of(
        [np.array([*ends[0], fin[0, 2] if steep[0] else 0.0]), *corners, np.array([*ends[1], 0.0])]
    )


def _rest(corners: Floats, run: _Run, row: _Row) -> list[Floats]:
    """The corners of a loop (K, 3) after the last fin and before the first."""
    count = len(corners)
    taken = row.last - row.first + 1
    return [corners[(run.first + row.last + 1 + k) % count] for k in range(count - taken)]


def _straight(corners: list[Floats]) -> Loop:
    """A loop without corners between two lines that are one."""
    kept = [
        corner
        for before, corner, after in zip(
            [corners[-1], *corners], corners, [*corners[1:], corners[0]], strict=False
        )
        if before[2] or corner[2] or not _is_between(before[:2], corner[:2], after[:2])
    ]
    return loop_of(kept)


def _is_between(before: Floats, corner: Floats, after: Floats) -> bool:
    way = after - before
    length = float(np.linalg.norm(way))
    if length < _NEAR:
        return False
    off = float(_across(way / length, (corner - before)[None])[0])
    return abs(off) < _NEAR and 0 < float((corner - before) @ way) < length**2
