"""Colours for signed deviations, and the bar that explains them."""

from __future__ import annotations

import math

import numpy as np

from partwright.render.sheet import SOFT_INK, draw_text
from partwright.shapes import length_text

# Blue where the result is missing material, light grey where it fits, red where it has too much.
_STOPS = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
_COLOURS = np.array([(38, 84, 165), (125, 170, 222), (226, 226, 224), (240, 150, 110), (186, 42, 50)])

_ROUND = (1, 1.5, 2, 3, 4, 5, 6, 8, 10)  # times a power of ten


def deviation_colours(deviation: np.ndarray, limit: float) -> np.ndarray:
    """(N, 3) sRGB 0..255 for signed deviations (N,), full colour at +-limit."""
    share = np.clip(deviation / limit, -1, 1)
    return np.stack([np.interp(share, _STOPS, _COLOURS[:, i]) for i in range(3)], axis=1)


def round_limit(deviation: np.ndarray) -> float:
    """The end of the scale, a round number: the largest deviation, as a rule.

    Where that is more than twice what 98 % of the deviations stay under, the scale ends there, or at a
    quarter of the largest: else a single far place would leave no colour for all others, and what is hardly
    off would look as bad as the worst.
    """
    sizes = np.abs(deviation)
    if not len(sizes) or not sizes.max() > 0:
        return 1.0
    largest = float(sizes.max())
    most = max(min(largest, 2 * float(np.quantile(sizes, 0.98))), largest / 4)
    power = 10.0 ** math.floor(math.log10(most))
    return next(step * power for step in _ROUND if step * power >= most * (1 - 1e-9))


def add_legend(image: np.ndarray, limit: float, unit: str | None, most: float = 0.0) -> np.ndarray:
    """The picture with a colour bar along its lower edge, labelled in the input's unit.

    most: the largest deviation in the picture, which is said where the bar ends before it.
    """
    height, width = image.shape[:2]
    left, right = round(0.24 * width), round(0.76 * width)
    y = height - 30
    result = image.copy()
    result[y : y + 8, left:right] = deviation_colours(np.linspace(-limit, limit, right - left), limit)
    labels = [
        (left, y + 17, f"-{length_text(limit, unit)}"),
        ((left + right) / 2, y + 17, "0" if most <= limit else f"largest {length_text(most, unit, 2)}"),
        (right, y + 17, f"+{length_text(limit, unit)}"),
        (left - 34, y + 3, "missing"),
        (right + 36, y + 3, "too much"),
    ]
    return draw_text(result, labels, size=12, colour=SOFT_INK)
