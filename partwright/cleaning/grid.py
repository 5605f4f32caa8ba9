"""Numbers that a person would type: multiples of 1, 2 or 5 times a power of ten."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.euler_angles import fixed_axes_angles, rotation_of

_FINEST = 1e-4  # of the longest side: lengths are typed to this
_RATIO = 1e-3
_DEGREES = 0.01
_EXACT = 1e-9  # of the longest side
_TURNED = 1e-5  # degrees: what a quaternion near a right angle may lose


@dataclass(frozen=True)
class Grid:
    """The finest lengths, in own units."""

    step: float
    """A power of ten: lengths are typed to this."""
    same: float
    """Two lengths that differ by less are one."""

    @classmethod
    def of(cls, longest: float) -> Grid:
        return cls(10.0 ** math.floor(math.log10(longest * _FINEST) + 1e-9), _EXACT * longest)

    def plain(self, value: float, ratio: bool = False) -> bool:
        """Whether somebody may have typed it; halves and quarters of the finest step count."""
        step, same = (_RATIO, _EXACT) if ratio else (self.step, self.same)
        return abs(value - round(4 * value / step) * step / 4) <= same

    def nearest(self, value: float, limit: float, ratio: bool = False) -> Iterator[float]:
        """Plain numbers within `limit`, those of the coarsest step first."""
        seen: set[float] = set()
        for step in _steps(abs(value) + limit, _RATIO if ratio else self.step):
            rounded = float(f"{round(value / step) * step:.12g}")
            if abs(rounded - value) <= limit and rounded not in seen:
                seen.add(rounded)
                yield rounded

    def finest(self, value: float, ratio: bool = False) -> tuple[float, ...]:
        """The nearest number of all that are plain, and the next above it, for where zero is not allowed."""
        step = _RATIO if ratio else self.step
        whole = round(value / step)
        return tuple(float(f"{k * step:.12g}") for k in (whole, whole + 1))


def plain_rotation(rotation: NDArray[np.float64]) -> bool:
    """Whether the angles about the fixed x, y and z are hundredths of a degree."""
    angles = np.array(fixed_axes_angles(rotation))
    return bool((np.abs(angles - np.rint(angles / _DEGREES) * _DEGREES) < _TURNED).all())


def rounded_rotations(rotation: NDArray[np.float64], limit: float) -> Iterator[NDArray[np.float64]]:
    """(3, 3) rotations at most `limit` degrees off in each angle about the fixed axes, plainest first."""
    angles = np.array(fixed_axes_angles(rotation))
    for step in _steps(max(2 * limit, _DEGREES), _DEGREES):
        rounded = np.rint(angles / step) * step
        if np.abs(rounded - angles).max() <= limit + 1e-9:
            yield rotation_of(*rounded.tolist())


def _steps(largest: float, finest: float) -> Iterator[float]:
    """5, 2 and 1 times powers of ten, from above `largest` down to `finest`."""
    power = math.ceil(math.log10(max(largest, finest))) if largest > 0 else math.floor(math.log10(finest))
    while 10.0**power >= finest * 0.999:
        for factor in (5, 2, 1):
            yield factor * 10.0**power
        power -= 1
