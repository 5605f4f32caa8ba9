"""What the sources for CAD programs share: named parameters, angles, the tree made plain."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.export.identifiers import identifiers
from partwright.fields import Field, Quadric

MEANING = {
    "size": "full extents x, y, z",
    "radius": "radius",
    "height": "height along z",
    "thickness": "thickness of the wall",
    "bottom_radius": "radius at the lower end",
    "top_radius": "radius at the upper end",
    "major_radius": "from the axis to the middle of the ring",
    "minor_radius": "radius of the ring itself",
    "place": "where the part's origin lies",
    "turn": "turned about x, y and z",
}


@dataclass(frozen=True)
class Parameter:
    """One line of the table on top: `variable` = `value`, a number or three."""

    variable: str
    name: str
    value: float | tuple[float, ...]


@dataclass(frozen=True)
class SourcePart:
    """A part of the source: the name of its function, and its parameters, place and turn last."""

    function: str
    part: Part
    parameters: tuple[Parameter, ...]

    def variables(self) -> dict[str, str]:
        """Name of the parameter -> name of the variable."""
        return {p.name: p.variable for p in self.parameters}


def source_parts(
    parts: Sequence[Part], turn: Callable[[np.ndarray], tuple[float, ...]], reserved: Collection[str]
) -> list[SourcePart]:
    """The parts with identifiers of which none is used twice; `turn` gives angles of a (3, 3) rotation."""
    from partwright.assembly.similarity import rotation_matrix

    values = []
    for part in parts:
        own = _parameters(part.field)
        values.append(own | {"place": part.translation, "turn": turn(rotation_matrix(part.rotation))})
    functions = identifiers([part.name for part in parts], reserved)
    wanted = [f"{f}_{name}" for f, own in zip(functions, values, strict=True) for name in own]
    variables = iter(identifiers(wanted, [*reserved, *functions]))
    return [
        SourcePart(f, part, tuple(Parameter(next(variables), name, value) for name, value in own.items()))
        for f, part, own in zip(functions, parts, values, strict=True)
    ]


def _parameters(field: Field) -> dict[str, Any]:
    """By name; a quadric's coefficients mean nothing to a reader."""
    if isinstance(field, Quadric):
        return {}
    return {entry.name: getattr(field, entry.name) for entry in dataclasses.fields(field)}  # type: ignore[arg-type]


def number(value: float) -> str:
    """Shortest text of twelve digits; no minus before a zero."""
    return f"{value + 0.0:.12g}"


def fixed_axes_angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Degrees about the fixed axes x, then y, then z, of a (3, 3) rotation."""
    r = rotation
    pitch = math.asin(min(1.0, max(-1.0, -r[2, 0])))
    if abs(r[2, 0]) > 1 - 1e-12:  # x and z then turn about the same line: all of it goes to z
        roll, yaw = 0.0, math.atan2(-r[0, 1], r[1, 1])
    else:
        roll, yaw = math.atan2(r[2, 1], r[2, 2]), math.atan2(r[1, 0], r[0, 0])
    x, y, z = (math.degrees(angle) for angle in (roll, pitch, yaw))
    return _clean(x), _clean(y), _clean(z)


def own_axes_angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Degrees about the part's own x, then its y, then its z, of a (3, 3) rotation."""
    x, y, z = fixed_axes_angles(rotation.T)
    return _clean(-x), _clean(-y), _clean(-z)


def plain_unions(node: Node) -> Node:
    """Nested unions flattened, and assemblies of one child replaced by it: the same, shorter to read."""
    if isinstance(node, Part):
        return node
    children: list[Node] = []
    for child in map(plain_unions, node.children):
        is_union = isinstance(child, Assembly) and child.operation == node.operation == "union"
        children += child.children if is_union and isinstance(child, Assembly) else (child,)
    return children[0] if len(children) == 1 else dataclasses.replace(node, children=tuple(children))


def _clean(degrees: float) -> float:
    return round(degrees, 9) + 0.0
