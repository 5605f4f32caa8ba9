"""Numbers of a part by name."""

from __future__ import annotations

import dataclasses
from typing import Any

from partwright.assembly.tree import Part


def numbers_of(part: Part) -> dict[str, float]:
    """The part's numbers by name: those of its field ("radius", "diameter", "size.x") and its place ("x")."""
    found: dict[str, float] = {}
    for entry in dataclasses.fields(part.field):  # type: ignore[arg-type]
        value = getattr(part.field, entry.name)
        if isinstance(value, float):
            found[entry.name] = value
            if entry.name.endswith("radius"):
                found[entry.name.replace("radius", "diameter")] = 2 * value
        elif entry.name == "size":
            found |= {f"size.{axis}": v for axis, v in zip("xyz", value, strict=True)}
    return found | dict(zip("xyz", part.translation, strict=True))


def with_number(part: Part, number: str, value: float) -> Part:
    """The part with one of its `numbers_of`. Raises ParameterError where its field does not allow it."""
    if number in ("x", "y", "z"):
        place = list(part.translation)
        place["xyz".index(number)] = value
        return dataclasses.replace(part, translation=(place[0], place[1], place[2]))
    if "diameter" in number:
        number, value = number.replace("diameter", "radius"), value / 2
    new: dict[str, Any] = {number: value}
    if number.startswith("size."):
        size = list(part.field.size)  # type: ignore[attr-defined]
        size["xyz".index(number[-1])] = value
        new = {"size": tuple(size)}
    return dataclasses.replace(part, field=dataclasses.replace(part.field, **new))  # type: ignore[type-var]
