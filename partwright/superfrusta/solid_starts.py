"""Starting solids of every kind for a region of volume."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.fields.columns import ROTATION, SHAPE, TRANSLATION, WIDTH, Column
from partwright.superfrusta.initialisation import ENOUGH, TRIM, along, extents, thinned
from partwright.superfrusta.samples import Rows

_LEAN, _HOLE = 0.8, 0.7  # taper and onion that frusta and hollow solids start with
_NONE = np.empty((0, 4), np.float32)


def starts(
    points: NDArray[np.float32], spacing: float, sign: float, frames: NDArray[np.float32] = _NONE
) -> Rows:
    """Starting rows (K, 17) of every kind for a region given by its voxel centres (n, 3).

    Along each principal and each coordinate axis; `frames` (F, 4), rotations (w, x, y, z), add boxes and
    cylinders. A part that is subtracted (sign -1) starts longer than its region, so that it cuts through.
    """
    points = thinned(points, ENOUGH).astype(np.float64)
    centre = points.mean(axis=0)
    local = points - centre
    _, axes = np.linalg.eigh(local.T @ local / len(local) + 1e-8 * np.eye(3))
    given = Rotation.from_quat(frames, scalar_first=True).as_matrix() if len(frames) else []
    places = [(along(basis, axis), form) for basis in (axes, np.eye(3)) for axis, form in _forms(sign)]
    places += [(frame, form) for frame in given for form in (_BOX, _CYLINDER)]
    turned = np.stack([frame for frame, _ in places])
    low, high = extents(local, turned)
    size = np.maximum((high - low) / (1 - 0.02 * TRIM) + 0.5 * spacing, 0.8 * spacing)
    size[:, 2] += 2 * spacing * (sign < 0)
    rows = np.zeros((len(places), WIDTH), np.float32)
    rows[:, TRANSLATION] = centre + np.einsum("kij,kj->ki", turned, (low + high) / 2)
    rows[:, ROTATION] = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    rows[:, SHAPE] = [form(*extent) for (_, form), extent in zip(places, size, strict=True)]
    rows[:, Column.SIGN] = sign
    return rows


# Sizes, roundness, dilation, taper, bulge, onion and blend of a kind within the extents x, y, z.
Form = Callable[[float, float, float], tuple[float, ...]]


def _round(taper: float, onion: float) -> Form:
    def form(x: float, y: float, z: float) -> tuple[float, ...]:
        width = float(np.sqrt(x * y))
        return width, width, z, 1.0, 0.0, taper, 0.0, onion, 0.0

    return form


def _square(onion: float) -> Form:
    return lambda x, y, z: (x, y, z, 0.0, 0.0, 1.0, 0.0, onion, 0.0)


def _sphere(x: float, y: float, z: float) -> tuple[float, ...]:
    return 0.0, 0.0, 0.0, 0.0, float(np.cbrt(x * y * z)) / 2, 1.0, 0.0, 0.0, 0.0


def _capsule(x: float, y: float, z: float) -> tuple[float, ...]:
    width = float(np.sqrt(x * y))
    return 0.0, 0.0, max(z - width, 0.2 * z), 0.0, width / 2, 1.0, 0.0, 0.0, 0.0


def _torus(x: float, y: float, z: float) -> tuple[float, ...]:
    width = float(np.sqrt(x * y))
    ring = max(width - z, 0.3 * width)
    return ring, ring, 0.0, 1.0, min(z, ring) / 2, 1.0, 0.0, 1.0, 0.0


_BOX, _CYLINDER = _square(0.0), _round(1.0, 0.0)


def _forms(sign: float) -> list[tuple[int, Form]]:
    """The axes of a basis and what starts along them. Of hollow kinds, only tubes are subtracted: grooves."""
    every = [_CYLINDER, _round(_LEAN, 0.0), _round(1.0, _HOLE), _capsule]
    every += [_square(_HOLE), _torus, _round(_LEAN, _HOLE)] if sign > 0 else []
    return [(0, _BOX), (0, _sphere), *((axis, form) for axis in range(3) for form in every)]
