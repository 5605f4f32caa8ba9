"""Rotations as three angles in degrees, the way that people and the sources of CAD programs write them."""

from __future__ import annotations

import math

import numpy as np

from partwright.assembly.similarity import Quaternion, quaternions, rotation_matrix

_TYPED = 0.5  # degrees: people type multiples of it
_NEAR = 1e-3  # degrees: so near to these all three angles are taken for them


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


def rotation_of(x: float, y: float, z: float) -> np.ndarray:
    """(3, 3) of degrees about the fixed axes x, then y, then z; quarter turns are exact."""
    (cx, sx), (cy, sy), (cz, sz) = (_cos_sin(angle) for angle in (x, y, z))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x, dtype=np.float64)


def typed_turn(rotation: Quaternion) -> Quaternion:
    """The turn by half degrees about the fixed axes that a rotation is but for dust: 45 for 44.9999994. The
    rotation itself where there is none.

    How near it has to be is the same for all, so that what was parallel stays so.
    """
    angles = np.array(fixed_axes_angles(rotation_matrix(rotation)))
    typed = np.rint(angles / _TYPED) * _TYPED
    off = float(np.abs(typed - angles).max())
    if off == 0 or off > _NEAR:
        return rotation
    w, x, y, z = quaternions(rotation_of(*typed.tolist())[None])[0].tolist()
    sign = math.copysign(1.0, w * rotation[0] + x * rotation[1] + y * rotation[2] + z * rotation[3])
    return sign * w, sign * x, sign * y, sign * z


def _cos_sin(degrees: float) -> tuple[float, float]:
    if degrees % 90 == 0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(degrees // 90) % 4]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def _clean(degrees: float) -> float:
    return round(degrees, 9) + 0.0
