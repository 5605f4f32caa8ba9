"""A shape with its hollows filled: what a body looks like before it is hollowed out.

A pot, a pipe or a housing is a plain body less a plain body. Growth cannot see that: it builds walls, piece
by piece. So where a shape has hollows, the body is grown first as if they were full, and carved afterwards.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.superfrusta.filling import filled
from partwright.superfrusta.samples import FitSamples

_WORTH = 0.1  # of the shape's volume that its hollows must have


def hollows(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Empty voxels (X, Y, Z) that the shape goes all around in a layer along one of the axes: closed holes,
    bores, and vessels that stand upright or lie."""
    found = np.zeros_like(occupied)
    for axis in range(3):
        layer = ndimage.generate_binary_structure(3, 1)
        layer[(slice(None),) * axis + ([0, 2],)] = False  # neighbours within the layer alone
        labels, count = ndimage.label(~occupied, layer)
        open_ = np.zeros(count + 1, bool)
        for other in {0, 1, 2} - {axis}:
            for side in (0, -1):
                open_[np.take(labels, side, axis=other)] = True
        open_[0] = True  # the shape itself
        found |= ~open_[labels]
    return found


def with_hollows_filled(samples: FitSamples) -> FitSamples | None:
    """Samples of the shape with its hollows filled; None where they are small."""
    occupied = samples.grid.values < 0
    filling = hollows(occupied)
    if np.count_nonzero(filling) < _WORTH * np.count_nonzero(occupied):
        return None
    return filled(samples, filling)
