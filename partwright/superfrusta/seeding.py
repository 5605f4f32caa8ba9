"""Starting parts for a region of volume: principal axes, and guesses of what it may be (section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.superfrusta.evidence import Rows
from partwright.superfrusta.refining import START_BLEND

Frame = NDArray[np.float64]  # columns are the part's axes

_ENOUGH = 600  # points that describe a region well enough for its extents
_NONE = np.empty((0, 4), np.float32)
_TRIM = 3.0  # percent at either end of an extent that do not count


def starts(points: NDArray[np.float32], spacing: float, frames: NDArray[np.float32] = _NONE) -> Rows:
    """Starting rows (K, 16) for a region given by its voxel centres (n, 3).

    Straight ones along each principal and each frame axis, boxy and round; hollow ones along each principal
    axis; bent ones along the longest, bulging to four sides. Optimisation from all of them decides, where the
    paper chooses one axis by its cylindricity: one start fails on bent and hollow regions. `frames` (F, 4),
    the rotations of parts that the region was covered by, add one boxy and one round start each.
    """
    points = points[:: max(1, len(points) // _ENOUGH)].astype(np.float64)
    centre = points.mean(axis=0)
    local = points - centre
    _, axes = np.linalg.eigh(local.T @ local / len(local) + 1e-8 * np.eye(3))

    def start(frame: Frame, roundness: float, bulge: float = 0.0, onion: float = 0.0) -> list[float]:
        low, high = np.percentile(local @ frame, [_TRIM, 100 - _TRIM], axis=0)
        size = np.maximum((high - low) / (1 - 0.02 * _TRIM) + 0.5 * spacing, 0.8 * spacing)
        middle = centre + frame @ ((low + high) / 2)
        x, y, z, w = Rotation.from_matrix(frame).as_quat()
        return [*middle, w, x, y, z, *size, roundness, 0.005, 1.0, bulge, onion, START_BLEND]

    rows = []
    for basis in (axes, np.eye(3)):
        for axis in range(3):
            frame = _along(basis, axis)
            rows += [start(frame, 0.2), start(frame, 0.9)]
    for w, x, y, z in frames:
        frame = Rotation.from_quat([x, y, z, w]).as_matrix()
        rows += [start(frame, 0.2), start(frame, 0.9)]
    rows += [start(_along(axes, axis), 0.9, onion=0.75) for axis in range(3)]
    longest = _along(axes, 2)
    for turn in range(4):
        rolled = longest @ Rotation.from_euler("z", 90 * turn, degrees=True).as_matrix()
        rows += [start(rolled, 0.8, bulge=bulge) for bulge in (0.4, 0.9)]
    return np.array(rows, dtype=np.float32)


def _along(basis: Frame, axis: int) -> Frame:
    """A right-handed frame whose z is the given column of the basis."""
    x, z = basis[:, (axis + 1) % 3], basis[:, axis]
    return np.stack([x, np.cross(z, x), z], axis=1)
