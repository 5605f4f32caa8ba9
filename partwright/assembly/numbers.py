"""Numbers of a part by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from partwright.assembly.files import MAX_PARTS
from partwright.assembly.instance_patterns import Circle, Grid, Line, Ring, pattern, with_pattern
from partwright.assembly.pipe_numbers import PREFIXES, pipe_numbers, with_pipe_numbers
from partwright.assembly.profile_numbers import PREFIX, profile_numbers, with_profile_numbers
from partwright.assembly.tree import Part
from partwright.errors import ParameterError

TOGETHER = (PREFIX, *PREFIXES)
"""What numbers begin with that are set together."""
_OF_COPIES = ("count", "circle", "start", "counts", "spacing", "step")


def numbers_of(part: Part) -> dict[str, float]:
    """The part's numbers by name: those of its field ("radius", "diameter", "size.x"), of its profile or
    path (`profile_numbers`, `pipe_numbers`), of its place ("x") and of the pattern of its copies ("count",
    "circle", "start"; "counts.x", "spacing.x"; "count", "step.x")."""
    found: dict[str, float] = {}
    for entry in dataclasses.fields(part.field):  # type: ignore[arg-type]
        value = getattr(part.field, entry.name)
        if isinstance(value, float):
            found[entry.name] = value
            if entry.name.endswith("radius"):
                found[entry.name.replace("radius", "diameter")] = 2 * value
        elif entry.name == "size":
            found |= {f"size.{axis}": v for axis, v in zip("xyz", value, strict=True)}
    found |= profile_numbers(part.field) | pipe_numbers(part.field)
    return found | dict(zip("xyz", part.translation, strict=True)) | _numbers_of_copies(part)


def _numbers_of_copies(part: Part) -> dict[str, float]:
    found = pattern(part)
    if isinstance(found, Ring):
        return {"count": found.count}
    if isinstance(found, Circle):
        return {"count": found.count, "circle": found.diameter, "start": found.start}
    if isinstance(found, Line):
        steps = {f"step.{axis}": step for axis, step in zip("xyz", found.step, strict=True) if step}
        return {"count": float(found.count)} | steps
    if isinstance(found, Grid):
        rows = [k for k in range(3) if found.count[k] > 1]
        counts = {f"counts.{'xyz'[k]}": float(found.count[k]) for k in rows}
        return counts | {f"spacing.{'xyz'[k]}": found.spacing[k] for k in rows}
    return {}


def with_values(part: Part, values: Mapping[str, float]) -> Part:
    """The part with some of its `numbers_of`; those of its profile are counted before any is set, and all of
    its path are set at once. Raises ParameterError where its field does not allow them."""
    of_profile = {number: value for number, value in values.items() if number.startswith(PREFIX)}
    of_path = {number: value for number, value in values.items() if number.startswith(PREFIXES)}
    if of_profile:
        part = dataclasses.replace(part, field=with_profile_numbers(part.field, of_profile))
    if of_path:
        part = dataclasses.replace(part, field=with_pipe_numbers(part.field, of_path))
    for number, value in values.items():
        part = part if number in of_profile or number in of_path else with_number(part, number, value)
    return part


def with_number(part: Part, number: str, value: float) -> Part:
    """The part with one of its `numbers_of`. Raises ParameterError where its field does not allow it."""
    if number in ("x", "y", "z"):
        place = list(part.translation)
        place["xyz".index(number)] = value
        return dataclasses.replace(part, translation=(place[0], place[1], place[2]))
    if number.partition(".")[0] in _OF_COPIES:
        return _with_number_of_copies(part, number, value)
    if number.startswith(TOGETHER):
        return with_values(part, {number: value})
    if "diameter" in number:
        number, value = number.replace("diameter", "radius"), value / 2
    new: dict[str, Any] = {number: value}
    if number.startswith("size."):
        size = list(part.field.size)  # type: ignore[attr-defined]
        size["xyz".index(number[-1])] = value
        new = {"size": tuple(size)}
    return dataclasses.replace(part, field=dataclasses.replace(part.field, **new))  # type: ignore[type-var]


def _with_number_of_copies(part: Part, number: str, value: float) -> Part:
    found: Any = pattern(part)
    name, _, axis = number.partition(".")
    if name in ("count", "counts"):
        if not 2 <= value <= MAX_PARTS or value != int(value):
            raise ParameterError(
                f"{number}: expected a whole number, at least 2 and at most {MAX_PARTS:,}, got {value:g}"
            )
        value = int(value)
    elif name in ("circle", "spacing") and value <= 0:
        raise ParameterError(f"{number}: expected a positive number, got {value:g}")
    name = {"circle": "diameter", "counts": "count"}.get(name, name)
    if axis:
        along = list(getattr(found, name))
        along["xyz".index(axis)] = value
        return with_pattern(part, dataclasses.replace(found, **{name: tuple(along)}))
    return with_pattern(part, dataclasses.replace(found, **{name: value}))
