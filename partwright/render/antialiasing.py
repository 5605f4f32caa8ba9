"""Where one ray a pixel is not enough: at the edges of the object, of its faces, and of its colours."""

from __future__ import annotations

import numpy as np

from partwright.render.camera import View
from partwright.render.raycast import Hits

RAYS = 2  # along a side of a pixel that lies on an edge
_CREASE = 0.95  # cosine between the normals of two neighbours, under which an edge runs between them
_JUMP = 0.35  # of the way from one neighbour to the other: further off its tangent plane is another surface


def edge_pixels(hits: Hits, labels: np.ndarray, width: int, height: int) -> np.ndarray:
    """Numbers (K,) of the pixels that see something else than a neighbour: the background, a surface turned
    or placed otherwise, or another label.

    hits: of one ray through the middle of each pixel. labels: (N,) of the hits, as whole numbers.
    """
    number = np.full((height, width), -1)
    number.reshape(-1)[hits.pixel] = np.arange(len(hits.pixel))
    edge = np.zeros((height, width), dtype=bool)
    for one, other in (
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
    ):
        differ = _differ(hits, labels, number[one], number[other])
        edge[one] |= differ
        edge[other] |= differ
    return np.flatnonzero(edge)


def _differ(hits: Hits, labels: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Whether an edge runs between pixels whose hits have these numbers, -1 where there is none."""
    differ = (first < 0) != (second < 0)
    both = (first >= 0) & (second >= 0)
    a, b = first[both], second[both]
    turned = np.einsum("nd,nd->n", hits.normal[a], hits.normal[b]) < _CREASE
    way = hits.point[b] - hits.point[a]
    off = [np.abs(np.einsum("nd,nd->n", hits.normal[side], way)) for side in (a, b)]
    jumps = np.maximum(*off) > _JUMP * np.linalg.norm(way, axis=1)
    differ[both] = turned | jumps | (labels[a] != labels[b])
    return differ


def rays_within(view: View, pixel: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """RAYS * RAYS rays through each of these pixels (K,): unit directions (N, 3), the pixel (N,) of each."""
    row, column = np.divmod(pixel, width)
    steps = (np.arange(RAYS) + 0.5) / RAYS
    across, down = np.tile(steps, RAYS), np.repeat(steps, RAYS)
    x = (column[:, None] + across).ravel() / width
    y = (row[:, None] + down).ravel() / height
    return view.through(x, y), np.repeat(pixel, RAYS * RAYS)
