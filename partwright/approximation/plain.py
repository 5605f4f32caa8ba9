"""The plainest number near another."""

from __future__ import annotations

import math


def plain(value: float, within: float) -> float:
    """The number of the fewest digits at most `within` away: 0, or multiples of 0.5 before further digits."""
    if value == 0 or within <= 0:
        return value
    if abs(value) <= within:
        return 0.0
    digits = -math.floor(math.log10(abs(value)))
    for decimals in range(digits, 13):
        for halves in (1, 2):
            unit = 10.0**-decimals / halves
            nearest = round(value / unit) * unit
            if abs(nearest - value) <= within:
                return round(nearest, max(decimals + halves - 1, 0)) + 0.0
    return value
