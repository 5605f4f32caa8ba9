"""Inside and outside of oriented points: their generalised winding number on a whole grid at once.

The winding number of oriented surface elements (Barill et al. 2018, "Fast winding numbers for soups and
clouds") solves Poisson's equation with their divergence on its right side (Kazhdan et al. 2006, "Poisson
surface reconstruction"). Fourier transforms solve it on a whole grid at once (Peng et al. 2021, "Shape as
points"): 1 inside, 0 outside, blurred over about a cell.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

_EMPTY = 0.15  # of the longest side on each side: the transform's grid repeats, its copies must keep away
_BLUR = 1.0  # cells


class Indicator:
    """Winding number around elements at points (N, 3) whose outward normals times area are `area_vectors`."""

    def __init__(
        self, points: NDArray[np.float64], area_vectors: NDArray[np.float64], spacing: float
    ) -> None:
        from scipy.fft import irfftn, next_fast_len, rfftn

        lower, upper = points.min(axis=0), points.max(axis=0)
        margin = int(np.ceil(_EMPTY * float((upper - lower).max()) / spacing)) + 3
        sides = np.ceil((upper - lower) / spacing).astype(int) + 2 * margin + 1
        shape = tuple(next_fast_len(int(n), real=True) for n in sides)
        self.spacing = spacing
        self._origin = lower - margin * spacing
        place = (points - self._origin) / spacing
        waves = [2 * np.pi * np.fft.fftfreq(n) for n in shape[:2]] + [2 * np.pi * np.fft.rfftfreq(shape[2])]
        wave = [w.astype(np.float32) for w in np.meshgrid(*waves, indexing="ij", sparse=True)]
        square = sum(w * w for w in wave)
        square[0, 0, 0] = 1.0
        divergence = np.zeros(square.shape, dtype=np.complex64)
        for axis in range(3):
            layer = _spread(place, area_vectors[:, axis] / spacing**2, shape)
            divergence += np.complex64(1j) * wave[axis] * rfftn(layer, workers=-1)
        divergence *= np.exp(-0.5 * _BLUR**2 * square) / square
        divergence[0, 0, 0] = 0.0
        self._values = irfftn(divergence, shape, workers=-1)
        self._values -= np.median(self._values[0])  # outside is 0; the transform leaves a constant open

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float32]:
        """Winding number (N,) at points (N, 3)."""
        from scipy.ndimage import map_coordinates

        return map_coordinates(
            self._values, ((points - self._origin) / self.spacing).T, order=1, mode="nearest"
        )

    def on_grid(
        self, origin: NDArray[np.float64], spacing: float, shape: tuple[int, ...]
    ) -> NDArray[np.float32]:
        """Winding number (nx, ny, nz) at origin + spacing * (i, j, k)."""
        from scipy.ndimage import affine_transform

        return affine_transform(
            self._values,
            np.full(3, spacing / self.spacing),
            (origin - self._origin) / self.spacing,
            output_shape=shape,
            order=1,
            mode="nearest",
        )


def _spread(
    place: NDArray[np.float64], weight: NDArray[np.float64], shape: tuple[int, ...]
) -> NDArray[np.float32]:
    """Weights (N,) shared out among the eight grid points around each place (N, 3), in grid steps."""
    base = np.floor(place).astype(np.int64)
    fraction = place - base
    total = np.zeros(int(np.prod(shape)))
    for corner in product((0, 1), repeat=3):
        share = np.where(corner, fraction, 1 - fraction).prod(axis=1)
        flat = np.ravel_multi_index(tuple((base + corner).T), shape)
        total += np.bincount(flat, share * weight, total.size)
    return total.reshape(shape).astype(np.float32)
