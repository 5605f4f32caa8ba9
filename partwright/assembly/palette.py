"""Colours for parts: pleasant, far apart, and the same for the same place in every picture and export."""

from __future__ import annotations

import colorsys

import numpy as np

# Hand-picked so that neighbours differ in hue and lightness; more parts continue by the golden angle.
_FIRST = (
    (0x4E, 0x8F, 0xD0),
    (0xF2, 0x9E, 0x4C),
    (0x5F, 0xB8, 0x7A),
    (0xDB, 0x5A, 0x6B),
    (0x9A, 0x7F, 0xD1),
    (0xF3, 0xC9, 0x5B),
    (0x4F, 0xBF, 0xC4),
    (0xE0, 0x8C, 0xB8),
    (0xA3, 0xC8, 0x5A),
    (0x6B, 0x77, 0xB8),
    (0xD9, 0x7B, 0x4A),
    (0x8F, 0xC9, 0xF0),
    (0xB4, 0x8A, 0x6A),
    (0x3F, 0x8F, 0x7F),
    (0xC5, 0x9F, 0xE0),
    (0xB9, 0x4F, 0x7F),
)
_GOLDEN_ANGLE = 0.381966


def palette(count: int) -> np.ndarray:
    """(count, 3) uint8 sRGB colours. The first n of any palette are the palette of n."""
    colours = list(_FIRST[:count])
    for i in range(len(colours), count):
        hue = (0.58 + i * _GOLDEN_ANGLE) % 1.0
        lightness, saturation = (0.52, 0.66, 0.42)[i % 3], (0.55, 0.65, 0.45)[i % 3]
        red, green, blue = colorsys.hls_to_rgb(hue, lightness, saturation)
        colours.append((round(255 * red), round(255 * green), round(255 * blue)))
    return np.array(colours, dtype=np.uint8).reshape(-1, 3)
