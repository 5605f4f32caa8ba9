"""Length units and up axes: the names that are understood, and what a unit measures in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.errors import SettingError

METRES = {
    "um": 1e-6,
    "mm": 1e-3,
    "cm": 1e-2,
    "m": 1.0,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
}
_ALIASES = {
    "micron": "um",
    "micrometre": "um",
    "micrometer": "um",
    "millimetre": "mm",
    "millimeter": "mm",
    "centimetre": "cm",
    "centimeter": "cm",
    "metre": "m",
    "meter": "m",
    "kilometre": "km",
    "kilometer": "km",
    "inch": "in",
    "inches": "in",
    "foot": "ft",
    "feet": "ft",
}
_SMALL = 0.1  # of a metre or a centimetre: shorter lengths are told in millimetres
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")


def canonical_unit(unit: str) -> str:
    """Short name of a length unit, one of `METRES`.

    Raises SettingError for a name that is not known.
    """
    name = unit.strip().lower()
    for candidate in (name, name.removesuffix("s")):
        short = _ALIASES.get(candidate, candidate)
        if short in METRES:
            return short
    raise SettingError(f"unknown length unit {unit!r}; expected one of {', '.join(METRES)}")


def length_text(length: float, unit: str | None, digits: int = 3) -> str:
    """A length for people, to so many digits: 0.25 of a metre is "0.25 m", 0.0002 is "0.2 mm". Without a unit
    it is the number alone."""
    if unit in ("m", "cm") and 0 < abs(length) < _SMALL:
        length, unit = length * METRES[unit] / METRES["mm"], "mm"
    return f"{length:.{digits}g}{f' {unit}' if unit else ''}"


def canonical_up(up: str) -> str:
    """Up axis as one of `UP_AXES`.

    Raises SettingError for anything else.
    """
    axis = up.strip().lower().removeprefix("+")
    if axis not in UP_AXES:
        raise SettingError(f"unknown up axis {up!r}; expected one of {', '.join(UP_AXES)}")
    return axis


def axis_vector(axis: str) -> NDArray[np.float64]:
    """(3,) unit vector of "x", "-y" ...

    Raises SettingError for anything else.
    """
    name = canonical_up(axis)
    result = np.zeros(3)
    result["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return result
