"""Equations between the numbers of a profile, met by moving its outline as little as they ask for."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.errors import ParameterError
from partwright.fields.profile import Profile, loop_of

Floats = NDArray[np.float64]

_STEPS = 10
# Solutions that are looked for, fewer of long outlines, each of which takes longer; equations that are left
# then are taken together or not at all.
_SOLUTIONS, _FEWEST, _CORNERS = 40, 5, 1000
_FAR = 3.0  # times as far as the outline may go: no later step leads back from there
_NUDGE = 1e-7  # of the size, for difference quotients
_MET = 1e-10  # of the size
_RANK = 1e-6
_OPEN = 0.1  # of a coordinate, that the equations must leave
_EXACT = 1e-14  # of the size: no step makes it better


@dataclass(frozen=True)
class Equation:
    """Something of the corners (V, 3) that is to be zero, a length."""

    corners: tuple[int, ...]
    """Which it depends on."""
    residual: Callable[[Floats], float]


def coordinate(corner: int, axis: int, value: float) -> Equation:
    """The corner's x (axis 0) or y (axis 1)."""
    return Equation((corner,), lambda c: float(c[corner, axis]) - value)


def centred(a: int, b: int, axis: int, value: float) -> Equation:
    """The x or y of the centre of the arc from a corner to the next."""
    return Equation((a, b), lambda c: arc(c, a, b)[axis] - value)


def round_of(a: int, b: int, radius: float) -> Equation:
    """The radius of the arc from a corner to the next."""
    return Equation((a, b), lambda c: arc(c, a, b)[2] - radius)


def smooth(a: int, b: int, then: int, size: float) -> Equation:
    """The sides from a to b and from b on run into one another without a corner."""

    def bend(c: Floats) -> float:
        before, after = _heading(c, a, b) + _half_turn(c, a), _heading(c, b, then) - _half_turn(c, b)
        return size * math.sin(after - before)

    return Equation((a, b, then), bend)


def arc(corners: Floats, a: int, b: int) -> tuple[float, float, float]:
    """Centre and radius of the arc from a corner to the next."""
    (ax, ay, bulge), (bx, by, _) = corners[a].tolist(), corners[b].tolist()
    lift = (1 - bulge * bulge) / (4 * bulge)
    chord = math.hypot(bx - ax, by - ay)
    x, y = (ax + bx) / 2 - (by - ay) * lift, (ay + by) / 2 + (bx - ax) * lift
    return x, y, chord * (1 + bulge * bulge) / (4 * abs(bulge))


def bend_at(corners: Floats, a: int, b: int, then: int) -> float:
    """Radians between the side that ends at a corner and the one that begins there, from -pi to pi."""
    before = _heading(corners, a, b) + _half_turn(corners, a)
    after = _heading(corners, b, then) - _half_turn(corners, b)
    return (after - before + math.pi) % (2 * math.pi) - math.pi


def _heading(corners: Floats, a: int, b: int) -> float:
    return math.atan2(corners[b, 1] - corners[a, 1], corners[b, 0] - corners[a, 0])


def _half_turn(corners: Floats, a: int) -> float:
    """Half of the angle of the arc that begins at a corner."""
    return 2 * math.atan(corners[a, 2])


@dataclass
class Solver:
    """A profile and the equations that it meets so far.

    within: how far any point of the outline may go.
    """

    profile: Profile
    within: float

    def __post_init__(self) -> None:
        self.given = self.profile.corners.copy()
        self.equations: list[Equation] = []
        self.left = max(_FEWEST, min(_SOLUTIONS, _CORNERS // len(self.given)))
        following = np.concatenate(
            [
                np.roll(np.arange(a, b), -1)
                for a, b in zip(self.profile.starts, self.profile.starts[1:], strict=False)
            ]
        )
        chord = np.hypot(*(self.given[following] - self.given)[:, :2].T)
        # Of a bulge's change the middle of an arc moves by half the chord.
        self.weights = np.column_stack([np.ones((len(self.given), 2)), np.maximum(chord / 2, 1e-9)])

    def take(self, equations: Sequence[Equation]) -> list[Equation]:
        """As many of the equations as agree with those before and with the limit; all at once, or else in
        halves. Returns those that were taken."""
        if not equations:
            return []
        found = self._solved([*self.equations, *equations])
        if found is not None:
            self.profile = found
            self.equations += equations
            return list(equations)
        if len(equations) == 1 or self.left <= 0:
            return []
        half = len(equations) // 2
        return self.take(equations[:half]) + self.take(equations[half:])

    def free(self) -> list[tuple[int, int]]:
        """Corners and axes whose coordinates the equations leave open, one after another."""
        corners = self.profile.corners
        off = np.array([equation.residual(corners) for equation in self.equations])
        slopes = self._slopes(self.equations, corners, off) if self.equations else np.zeros((1, corners.size))
        _, values, rows = np.linalg.svd(slopes, full_matrices=False)
        basis = list(rows[values > _RANK * max(float(values[0]), 1.0)])
        found = []
        for corner in range(len(corners)):
            for axis in (0, 1):
                unit = np.zeros(corners.size)
                unit[3 * corner + axis] = 1.0
                known = np.array(basis).reshape(-1, corners.size)
                rest = unit - known.T @ (known @ unit)
                length = float(np.linalg.norm(rest))
                if length > _OPEN:
                    basis.append(rest / length)
                    found.append((corner, axis))
        return found

    def _solved(self, equations: list[Equation]) -> Profile | None:
        corners, size = self.profile.corners.copy(), self.profile.size
        self.left -= 1
        worst = np.inf
        for _ in range(_STEPS):
            off = np.array([equation.residual(corners) for equation in equations])
            before, worst = worst, float(np.abs(off).max())
            moved = float(np.abs((corners - self.given) * self.weights).max())
            if not np.isfinite(off).all() or moved > _FAR * self.within:
                return None
            if worst <= _EXACT * size or (worst <= _MET * size and worst > before / 2):
                break
            if worst > before / 2:  # they contradict one another
                return None
            step = np.linalg.lstsq(self._slopes(equations, corners, off), -off, rcond=1e-10)[0].reshape(-1, 3)
            step[corners[:, 2] == 0, 2] = 0.0  # lines stay lines
            corners = corners + step / self.weights
        if (
            np.abs(off).max() > _MET * size
            or np.abs((corners - self.given) * self.weights).max() > self.within
        ):
            return None
        return with_corners(self.profile, corners)

    def _slopes(self, equations: list[Equation], corners: Floats, off: Floats) -> Floats:
        """(E, 3 V) by corners and bulges, each weighted; bulges of lines stay."""
        slopes = np.zeros((len(equations), corners.size))
        nudge = _NUDGE * self.profile.size
        for row, equation in enumerate(equations):
            for corner in equation.corners:
                for axis in range(3):
                    if axis == 2 and corners[corner, 2] == 0:
                        continue
                    moved = corners.copy()
                    moved[corner, axis] += nudge / self.weights[corner, axis]
                    slopes[row, 3 * corner + axis] = (equation.residual(moved) - off[row]) / nudge
        return slopes


def with_corners(profile: Profile, corners: Floats) -> Profile | None:
    """The profile with other corners (V, 3); None where that is none."""
    loops = [
        loop_of(corners[start:end]) for start, end in zip(profile.starts, profile.starts[1:], strict=False)
    ]
    try:
        return Profile.of_loops(loops)
    except ParameterError:
        return None
