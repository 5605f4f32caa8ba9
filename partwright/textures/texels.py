"""Values of a map's texels, solved for: what a renderer reads between them is to be what was seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STEPS = 40  # of conjugate gradients; they rarely need half
_ENOUGH = 1e-3  # of the values' own unit: the step of a texel after which there is nothing left to gain
_HELD = 0.005  # pull of a texel towards the mean of what was seen near it, in shares of what it has seen, or
# of what most have where that is more: at a border little is seen, and nothing else keeps a texel there
_FIRM = 0.05  # of what most have seen: texels that saw less tell nothing of those around them


class Texels:
    """Least squares for the texels of one map, `sides` squares of `size` texels a side, beside one another.

    Each thing seen is at a place between four texels, whose bilinear mean should be its values. The sums of
    all of them are kept as normal equations, so that any number can be added.
    """

    def __init__(self, size: int, sides: int, channels: int) -> None:
        from scipy.sparse import csr_array

        self.size, self.sides = size, sides
        count = size * size * sides
        self._matrix = csr_array((count, count))
        self._right = np.zeros((count, channels))

    def add(self, place: Floats, side: NDArray[np.bool_], values: Floats, weights: Floats) -> None:
        """Places (N, 2) in [0, 1]^2, which square (N,), values (N, C) and weights (N,)."""
        from scipy.sparse import csr_array

        texel, share = corners(place, self.size)
        number = (texel[:, :, 1] * self.sides + side[:, None]) * self.size + texel[:, :, 0]
        rows = np.arange(0, 4 * len(place) + 1, 4)
        reads = csr_array((share.ravel(), number.ravel(), rows), shape=(len(place), len(self._right)))
        weighted = csr_array(((weights[:, None] * share).ravel(), number.ravel(), rows), shape=reads.shape)
        self._matrix = self._matrix + weighted.T @ reads
        self._right += weighted.T @ values

    @property
    def any(self) -> bool:
        """Whether anything was seen."""
        return bool(self._matrix.nnz)

    def means(self) -> tuple[Floats, Floats]:
        """Of each texel the mean (size, sides * size, C) of what was seen around it, and how much was."""
        seen = np.asarray(self._matrix.sum(axis=1)).ravel()
        known = seen > 0
        values = np.zeros_like(self._right)
        values[known] = self._right[known] / seen[known, None]
        return self._square(values), self._square(seen)

    def solved(self) -> tuple[Floats, Floats]:
        """Of each texel the values with which all that was seen is met best, and how much was."""
        values, seen = self.means()
        flat = values.reshape(self._right.shape)
        pull = _HELD * np.maximum(seen.ravel(), _typical(seen))
        hold = np.where(seen.ravel() > 0, pull, 1.0)  # others stay as they are
        scale = 1 / (self._matrix.diagonal() + hold)

        def residual(x: Floats) -> Floats:
            return np.asarray(self._right - self._matrix @ x + hold[:, None] * (flat - x))

        x = flat.copy()
        left = residual(x)
        steered = scale[:, None] * left
        along, size = steered.copy(), (left * steered).sum(axis=0)
        for _ in range(_STEPS):
            through = self._matrix @ along + hold[:, None] * along
            step = size / np.maximum((along * through).sum(axis=0), 1e-300)
            x += step * along
            if np.abs(step * along).max() < _ENOUGH:
                break
            left -= step * through
            steered = scale[:, None] * left
            before, size = size, (left * steered).sum(axis=0)
            along = steered + size / np.maximum(before, 1e-300) * along
        return self._square(x), seen

    def _square(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(self.size, self.sides * self.size, *values.shape[1:])


def corners(place: Floats, size: int) -> tuple[NDArray[np.int64], Floats]:
    """The four texels (N, 4, 2), column and row, around places (N, 2) in [0, 1]^2, and shares (N, 4)."""
    at = np.clip(place * size - 0.5, 0, size - 1)
    low = np.minimum(np.floor(at), max(size - 2, 0))
    step = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
    texel = np.minimum(low[:, None] + step, size - 1).astype(np.int64)
    part = (at - low)[:, None]
    across, up = np.where(step, part, 1 - part).transpose(2, 0, 1)
    return texel, across * up


def read(image: NDArray[np.uint8], place: Floats, side: NDArray[np.bool_]) -> Floats:
    """Values (N, C) of a map's image at places (N, 2) in [0, 1]^2 of either square (N,): bilinear."""
    size = image.shape[0]
    texel, share = corners(place, size)
    column = texel[:, :, 0] + np.where(side, size, 0)[:, None]
    return np.asarray((share[:, :, None] * image[texel[:, :, 1], column]).sum(axis=1))


def filled(values: Floats, seen: Floats, sides: int) -> Floats:
    """Texels that nothing was seen of take the values of the nearest one that saw enough; of a whole side, of
    the first. seen (size, sides * size): how much each has."""
    size = values.shape[0]
    firm = seen >= _FIRM * _typical(seen)
    result = values.copy()
    for side in range(sides):
        own = slice(side * size, (side + 1) * size)
        known = seen[:, own] > 0
        nearest = nearest_known(result[:, own], known & firm[:, own]) if known.any() else result[:, :size]
        result[:, own] = np.where(known[..., None], result[:, own], nearest)
    return result


def _typical(seen: Floats) -> float:
    """What most texels that saw anything have seen; 0 where none has."""
    return float(np.median(seen[seen > 0])) if (seen > 0).any() else 0.0


def nearest_known(values: Floats, known: NDArray[np.bool_]) -> Floats:
    """Values (h, w, C) of which those that are not known (h, w) are as the nearest one that is."""
    from scipy.ndimage import distance_transform_edt

    if known.all() or not known.any():
        return values
    rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(values[rows, columns])
