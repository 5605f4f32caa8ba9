"""Rotations as three angles in degrees, the way that people and the sources of CAD programs write them."""

from __future__ import annotations

import math

import numpy as np


def fixed_axes_angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Degrees about the fixed axes x, then y, then z, of a (3, 3) rotation."""
    r = rotation
    pitch = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
    if abs(r[2, 0]) > 1 - 1e-12:  # x and z then turn about the same line: all of it goes to z
        roll, yaw = 0.0, math.atan2(-r[0, 1], r[1, 1])
    else:
        roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    x, y, z = (math.degrees(angle) for angle in (roll, pitch, yaw))
    return _clean(x), _clean(y), _clean(z)


def own_axes_angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Degrees about the part's own x, then its y, then its z, of a (3, 3) rotation."""
    x, y, z = fixed_axes_angles(rotation.T)
    return _clean(-x), _clean(-y), _clean(-z)


def _clean(degrees: float) -> float:
    return round(degrees, 9) + 0.0
