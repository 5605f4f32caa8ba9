"""Which links collide at rest, by what they have in common."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from manifold3d import Manifold

Pair = tuple[str, str]
# Of the smaller one's volume: less is touching, as enclosing shapes are larger by rounding.
LEAST_SHARED = 1e-5


def overlaps(solids: Mapping[str, Manifold]) -> dict[Pair, float]:
    """Volume that two links have in common, for each pair that has any. solids: the links', in the world."""
    boxes = {name: np.reshape(solid.bounding_box(), (2, 3)) for name, solid in solids.items()}
    volumes = {name: solid.volume() for name, solid in solids.items()}
    found = {}
    for a, b in combinations(solids, 2):
        if (boxes[a][0] < boxes[b][1]).all() and (boxes[b][0] < boxes[a][1]).all():
            common = (solids[a] ^ solids[b]).volume()
            if common > LEAST_SHARED * min(volumes[a], volumes[b]):
                found[a, b] = float(common)
    return found


def too_near(
    before: Mapping[Pair, float], after: Mapping[Pair, float], volumes: Mapping[str, float], share: float
) -> list[Pair]:
    """Pairs that overlap more than they did, by more than a share of the smaller one's volume."""
    return [
        pair
        for pair, volume in after.items()
        if volume - before.get(pair, 0.0) > share * min(volumes[name] for name in pair)
    ]
