"""Checks of what goes into parts and assemblies: each returns the value in its canonical type, or raises."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

MAX_NAME = 200


def number(value: object, name: str) -> float:
    """`value` as a finite float.

    Raises:
        ParameterError: it is no number, or NaN or infinite.
    """
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise ParameterError(f"{name}: expected a finite number, got {value!r}") from error
    if isinstance(value, str | bool) or not math.isfinite(result):
        raise ParameterError(f"{name}: expected a finite number, got {value!r}")
    return result


def vector(value: Sequence[float], name: str) -> Vector:
    """`value` as three floats as `length` has them."""
    value = _sequence(value, 3, "(x, y, z)", name)
    x, y, z = (length(component, f"{name}[{i}]") for i, component in enumerate(value))
    return x, y, z


def length(value: object, name: str) -> float:
    """`value` as a float whose square still fits into float32, in which distances are computed."""
    result = number(value, name)
    if abs(result) > LARGEST:
        raise ParameterError(
            f"{name}: expected a number between -{LARGEST:g} and {LARGEST:g}, got {result:g}"
        )
    return result


def unit_quaternion(value: Sequence[float], name: str) -> Quaternion:
    """`value` as a unit quaternion (w, x, y, z). One that already is of unit length is kept to the bit."""
    value = _sequence(value, 4, "(w, x, y, z)", name)
    w, x, y, z = (number(component, f"{name}[{i}]") for i, component in enumerate(value))
    length = math.hypot(w, x, y, z)
    if not 1e-6 < length < 1e6:
        raise ParameterError(f"{name}: {(w, x, y, z)} has length {length:g} and so is no rotation")
    if abs(length - 1.0) < 1e-12:
        return w, x, y, z
    return w / length, x / length, y / length, z / length


def blend_width(value: object) -> float:
    """`value` as a float of at least 0."""
    width = length(value, "blend")
    if width < 0:
        raise ParameterError(f"blend: expected a number of at least 0, got {width:g}")
    return width


def printable_name(value: object) -> str:
    """`value` as a name: printable, of reasonable length; may be empty."""
    if not isinstance(value, str) or len(value) > MAX_NAME or not (value or "x").isprintable():
        raise ParameterError(f"name: expected at most {MAX_NAME} printable characters, got {value!r:.80}")
    return value


def flat_metadata(value: Mapping[str, str | float]) -> dict[str, str | float]:
    """A copy of `value`, which maps strings to strings and finite numbers."""
    for key, entry in value.items():
        if not isinstance(key, str) or isinstance(entry, bool) or not isinstance(entry, str | int | float):
            raise ParameterError(f"metadata[{key!r}]: expected a string or a number, got {entry!r}")
        if not isinstance(entry, str):
            number(entry, f"metadata[{key!r}]")
    return dict(value)


def _sequence(value: Sequence[float], length: int, meaning: str, name: str) -> Sequence[float]:
    given = len(value) if hasattr(value, "__len__") else repr(value)
    if given != length:
        raise ParameterError(f"{name}: expected {length} numbers {meaning}, got {given}")
    return value
