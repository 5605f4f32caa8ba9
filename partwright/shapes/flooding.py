"""A flood of a grid from outside: what it does not reach is enclosed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def reached_from_outside(free: NDArray[np.floating], where: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which places (X, Y, Z) of those it may flow through a flood reaches from outside, side by side.

    free: (X, Y, Z) by how much each is clear of what stops the flood; it starts at the corner of the grid
    where that is most. where: (X, Y, Z) the places that it may flow through.
    """
    from scipy.ndimage import label

    labels, _ = label(where)
    ends = np.ix_([0, -1], [0, -1], [0, -1])
    return np.asarray(labels == labels[ends].ravel()[free[ends].argmax()])
