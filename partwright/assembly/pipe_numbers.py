"""Numbers of a pipe by name: its corners, and the radius of the bend at each."""

from __future__ import annotations

from collections.abc import Mapping

from partwright.fields import Field, Pipe

PREFIXES = ("path.", "bend.")


def pipe_numbers(field: Field) -> dict[str, float]:
    """Places of corners, the first is 1 ("path.2.x"), and radii of the bends there ("bend.2"). Of other
    fields none."""
    if not isinstance(field, Pipe):
        return {}
    found: dict[str, float] = {}
    for k, (*place, bend) in enumerate(field.path, start=1):
        found |= {f"path.{k}.{axis}": value for axis, value in zip("xyz", place, strict=True)}
        found |= {f"bend.{k}": bend} if bend else {}
    return found


def with_pipe_numbers(field: Field, values: Mapping[str, float]) -> Pipe:
    """The pipe with some of its numbers. Raises ParameterError where bends do not fit then."""
    assert isinstance(field, Pipe)
    path = field.corners
    for number, value in values.items():
        kind, index, *axis = number.split(".")
        path[int(index) - 1, "xyz".index(axis[0]) if kind == "path" else 3] = value
    return field.with_corners(path)
