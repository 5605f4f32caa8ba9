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


def closed_sections(occupied: NDArray[np.bool_], axis: int) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
    """Labels (X, Y, Z) of what is empty and connected within a layer across an axis, 0 for the shape itself;
    and of each label whether the shape goes all around it there."""
    layer = ndimage.generate_binary_structure(3, 1)
    layer[(slice(None),) * axis + ([0, 2],)] = False  # neighbours within the layer alone
    labels, count = ndimage.label(~occupied, layer)
    closed = np.ones(count + 1, bool)
    closed[0] = False
    for other in {0, 1, 2} - {axis}:
        for side in (0, -1):
            closed[np.take(labels, side, axis=other)] = False
    return labels, closed


def hollows(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Empty voxels (X, Y, Z) that the shape goes all around in a layer along one of the axes: closed holes,
    bores, and vessels that stand upright or lie."""
    found = np.zeros_like(occupied)
    for axis in range(3):
        labels, closed = closed_sections(occupied, axis)
        found |= closed[labels]
    return found


def with_hollows_filled(samples: FitSamples) -> FitSamples | None:
    """Samples of the shape with its hollows filled; None where they are small."""
    occupied = samples.grid.values < 0
    filling = hollows(occupied)
    if np.count_nonzero(filling) < _WORTH * np.count_nonzero(occupied):
        return None
    return filled(samples, filling)
