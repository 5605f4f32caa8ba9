"""The volume of a solid whose field is all that is known of it."""

from __future__ import annotations

import numpy as np

from partwright.assembly import Node

_CELLS = 1_000_000
_CHUNK = 200_000


def sampled_volume(node: Node) -> float:
    """In cubed units of the node's own, by one random point in each of a million cells of its box: of what
    fills a tenth of the box within about 0.1 %. The same every time.

    Raises:
        ValueError: the node has no end.
    """
    low, high = np.asarray(node.bounds(), dtype=np.float64)
    if not np.isfinite([low, high]).all():
        raise ValueError(f"{node.name!r} has no end, so it has no volume")
    sides = np.maximum(high - low, np.finfo(np.float64).tiny)
    counts = np.maximum(np.rint(sides * (_CELLS / sides.prod()) ** (1 / 3)), 1).astype(int)
    rng = np.random.default_rng(0)
    inside = 0
    for start in range(0, int(counts.prod()), _CHUNK):
        cells = np.arange(start, min(start + _CHUNK, int(counts.prod())))
        corner = np.stack(np.unravel_index(cells, counts), axis=1)
        points = low + (corner + rng.random(corner.shape)) * (sides / counts)
        inside += int(np.count_nonzero(np.asarray(node.distance(points)) < 0))
    return float(inside / counts.prod() * sides.prod())
