"""Starting parts for a region of volume: principal axes, and guesses of what it may be (section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.fields.columns import ROTATION, SIZE, TRANSLATION, WIDTH, Column
from partwright.rows import crosses
from partwright.superfrusta.refining import START_BLEND
from partwright.superfrusta.samples import Rows

ENOUGH = 600  # points that describe a region well enough for its extents
_NONE = np.empty((0, 4), np.float32)
_GOLDEN = (5**0.5 - 1) / 2
TRIM = 3.0  # percent at either end of an extent that do not count
_DILATION = 0.005
_BOXY, _ROUND = 0.2, 0.9
_BENT = [(turn, bulge) for turn in range(4) for bulge in (0.4, 0.9)]  # quarter turns about the axis, bulge


def starts(points: NDArray[np.float32], spacing: float, frames: NDArray[np.float32] = _NONE) -> Rows:
    """Starting rows (K, 17) for a region given by its voxel centres (n, 3).

    Straight ones along each principal and each frame axis, boxy and round; hollow ones along each principal
    axis; bent ones along the longest, bulging to four sides. Optimisation from all of them decides, where the
    paper chooses one axis by its cylindricity: one start fails on bent and hollow regions. `frames` (F, 4),
    the rotations of parts that the region was covered by, add one boxy and one round start each.
    """
    points = thinned(points, ENOUGH).astype(np.float64)
    centre = points.mean(axis=0)
    local = points - centre
    _, axes = np.linalg.eigh(local.T @ local / len(local) + 1e-8 * np.eye(3))
    principal = [along(axes, axis) for axis in range(3)]
    given = Rotation.from_quat(frames, scalar_first=True).as_matrix() if len(frames) else []
    straight = [*principal, *_WORLD, *given]

    # frame, roundness, bulge, onion of each start
    guesses = [(frame, roundness, 0.0, 0.0) for frame in straight for roundness in (_BOXY, _ROUND)]
    guesses += [(frame, _ROUND, 0.0, 0.75) for frame in principal]
    guesses += [(principal[2] @ _QUARTERS[turn], 0.8, bulge, 0.0) for turn, bulge in _BENT]

    turned = np.stack([frame for frame, *_ in guesses])
    low, high = extents(local, turned)
    size = np.maximum((high - low) / (1 - 0.02 * TRIM) + 0.5 * spacing, 0.8 * spacing)
    rows = np.empty((len(guesses), WIDTH), np.float32)
    rows[:, TRANSLATION] = centre + np.einsum("kij,kj->ki", turned, (low + high) / 2)
    rows[:, ROTATION] = Rotation.from_matrix(turned).as_quat(scalar_first=True)
    rows[:, SIZE] = size
    rows[:, Column.ROUNDNESS :] = [
        (roundness, _DILATION, 1.0, bulge, onion, START_BLEND, 1.0) for _, roundness, bulge, onion in guesses
    ]
    return rows


def thinned(points: NDArray[np.float32], enough: int) -> NDArray[np.float32]:
    """About `enough` of the points (n, 3), and no more than twice as many; all where there are fewer.

    One of each `n // enough` in a row, at a place of its own by the golden ratio: voxels come in rows, and
    where the step divides a row, every step-th of them leaves whole layers out.
    """
    step = max(1, len(points) // enough)
    first = np.arange(0, len(points) - step + 1, step)
    return points[first + (step * (np.arange(len(first)) * _GOLDEN % 1)).astype(int)]


def extents(
    local: NDArray[np.float64], frames: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ends (K, 3) of the points along the columns of the frames (K, 3, 3), outliers trimmed."""
    last = len(local) - 1
    below = int(last * TRIM / 100)
    sorted_ = np.partition(frames.transpose(0, 2, 1) @ local.T, (below, last - below), axis=-1)
    return sorted_[..., below], sorted_[..., last - below]


def along(basis: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """A right-handed frame whose z is the given column of the basis."""
    x, z = basis[:, (axis + 1) % 3], basis[:, axis]
    return np.stack([x, crosses(z, x), z], axis=1)


_WORLD = [along(np.eye(3), axis) for axis in range(3)]
_QUARTERS = Rotation.from_euler("z", 90 * np.arange(4)[:, None], degrees=True).as_matrix()
