"""Lengths as they are asked for: a number in the shape's units, or text as "0.5mm" or "1%"."""

from __future__ import annotations

import math
import numbers
import re

from partwright.errors import SettingError
from partwright.shapes.units import METRES, canonical_unit

Length = float | str
_TEXT = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*|%)\s*")


def parse_length(given: Length) -> tuple[float, str]:
    """The number, 0 or more, and what follows it: "", "%", or one of `METRES`.

    Raises:
        SettingError: it is no length.
    """
    text = _TEXT.fullmatch(given) if isinstance(given, str) else None
    number = math.nan
    if text is not None or (isinstance(given, numbers.Real) and not isinstance(given, bool)):
        number = float(text[1] if text else given)
    if not math.isfinite(number) or number < 0:
        raise SettingError(f'expected a length such as 0.5, "0.5mm" or "1%", got {given!r}')
    suffix = text[2] if text else ""
    return number, suffix if suffix in ("", "%") else canonical_unit(suffix)


def own_length(given: Length, unit: str | None, longest_side: float) -> float:
    """The length in units of a shape whose longest side, in them, is known.

    Raises:
        SettingError: it is no length, or has a unit where the shape has none.
    """
    number, suffix = parse_length(given)
    if suffix == "%":
        return number / 100 * longest_side
    if suffix and unit is None:
        raise SettingError(
            f"{given!r} has a unit but the shape has none; state it (--unit), or give a plain number"
        )
    return number * METRES[suffix] / METRES[unit] if suffix and unit else number
