"""The smallest ball around points, or the smallest circle."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

_SAME = 1e-12  # of the squared radius: what is no farther out is within


def smallest_ball(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre and radius of the smallest ball that contains points (N, d).

    Few points on its surface determine it. As long as one is outside, it is the farthest one with some of
    these that do: the ball grows with every exchange (after Welzl 1991, who exchanges at random).
    """
    centre = points.mean(axis=0)
    support = points[((points - centre) ** 2).sum(axis=1).argmax()][None]
    centre, square = support[0], 0.0
    while True:
        away = ((points - centre) ** 2).sum(axis=1)
        far = int(away.argmax())
        if away[far] <= square * (1 + _SAME):
            break
        grown = min(_through(points[far], support), key=lambda ball: ball[1], default=None)
        if grown is None or grown[1] <= square * (1 + _SAME):  # all that is left is rounding
            break
        centre, square, support = grown
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))


def _through(point: np.ndarray, others: np.ndarray) -> Iterator[tuple[np.ndarray, float, np.ndarray]]:
    """Balls through a point (d,) and some of others (M, d), that contain all of them: centre, squared radius,
    and the points on the surface."""
    for count in range(1, min(len(others), len(point)) + 1):
        for chosen in combinations(range(len(others)), count):
            on = others[list(chosen)]
            sides = on - point
            products = sides @ sides.T
            try:
                shares = np.linalg.solve(2 * products, np.diag(products))
            except np.linalg.LinAlgError:  # they lie on a line, or in a plane
                continue
            step = shares @ sides
            square = float(step @ step)
            if (((others - point - step) ** 2).sum(axis=1) <= square * (1 + 1e-9)).all():
                yield point + step, square, np.concatenate([point[None], on])
