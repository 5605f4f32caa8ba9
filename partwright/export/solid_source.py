"""What the sources for CAD programs share: named parameters, angles, the tree made plain."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from partwright.approximation.nearest import Approximation
from partwright.approximation.recognise import SAME, exact_solid
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.instance_patterns import Circle, Grid, Line, Pattern, Poses, Row, pattern
from partwright.assembly.metadata import thread_names
from partwright.assembly.motion import Motion
from partwright.assembly.repeated_groups import children_once, repeats
from partwright.assembly.similarity import rotation_matrix
from partwright.export.identifiers import comment, identifiers
from partwright.export.pipe_source import MEANING as PIPE_MEANING
from partwright.export.pipe_source import pipe_parameters
from partwright.export.profile_source import meaning, swept_parameters
from partwright.fields import Field, HollowBox, HollowFrustum, Pipe, SuperFrustum, Swept
from partwright.fields.extrusion import RIMS

MEANING = {
    "size": "full extents x, y, z",
    "radius": "radius",
    "height": "height along z",
    "thickness": "thickness of the wall",
    "bottom_radius": "radius at the lower end",
    "top_radius": "radius at the upper end",
    "major_radius": "from the axis to the middle of the ring",
    "minor_radius": "radius of the ring itself",
    "roundness": "of the corners of the cross-section, 0 to 1",
    "dilation": "grown by",
    "taper": "the top leans in (below 1) or out (to 2)",
    "bulge": "bent into an arc towards -x, 0 to 1",
    "onion": "hollow, from 0 to 1",
    "place": "where the part's origin lies",
    "turn": "turned about x, y and z",
    "places": "where the origins of the copies lie",
    "poses": "where the origin of each copy lies, and its turn about x, y and z in degrees",
    "count": "copies, by equal turns or steps",
    "counts": "copies along x, y and z",
    "spacing": "from one copy to the next along x, y and z",
    "step": "from one copy to the next",
    "middle": "of the origins of the copies",
    "circle": "diameter of the circle through the origins of the copies",
    "start": "where on the circle the first is",
    "bottom_fillet": "radius of the fillet around the lower end",
    "top_fillet": "radius of the fillet around the upper end",
    "bottom_chamfer": "by which the edges of the lower end are cut off at 45 degrees",
    "top_chamfer": "by which the edges of the upper end are cut off at 45 degrees",
    "angle": "through which the profile is turned",
    "centre": "about which these turns are",
    **PIPE_MEANING,
}
_LEAN = "by which the walls lean inwards on their way up"
_NO_UNIT = ("roundness", "taper", "bulge", "onion", "count", "counts", "poses")
_SHARED = (
    "radius",
    "height",
    "thickness",
    "bottom_radius",
    "top_radius",
    "major_radius",
    "minor_radius",
    "bend",
    *RIMS,
)
Value = float | tuple[Any, ...]


@dataclass(frozen=True)
class Parameter:
    """One line of the table on top: `variable` = `value`, a number, three, or a list of such.

    same_as: the variable of an earlier part's parameter of this name and value, which stands in its place.
    """

    variable: str
    name: str
    value: Value
    of_profile: bool = False
    same_as: str | None = None

    def line(self, brackets: str, unit: str | None) -> tuple[str, str]:
        """The value in the language's brackets, and what is said of it."""
        angles = self.name in ("turn", "angle", "start") or (self.name == "taper" and self.of_profile)
        measure = "degrees" if angles else None if self.name in _NO_UNIT else unit
        said = _LEAN if self.name == "taper" and self.of_profile else MEANING.get(self.name)
        said = said or meaning(self.name) or self.name
        value = self.same_as or literal(self.value, brackets)
        return value, f"{measure}: {said}" if measure else said


@dataclass(frozen=True)
class SourcePart:
    """A part of the source: the name of its function, and its parameters, those of its place last.

    copies: the pattern of a repeated part.
    """

    function: str
    part: Part
    parameters: tuple[Parameter, ...]
    copies: Pattern | None = None

    @property
    def title(self) -> str:
        """The part's name, its threads if it has any, and how often it is there."""
        times = f", {len(self.part.copies)} times" if self.copies else ""
        thread = "".join(f", thread {comment(name)}" for name in thread_names(self.part.metadata))
        return f"{comment(self.part.name)}{thread}{times}"

    def variables(self) -> dict[str, str]:
        """Name of the parameter -> name of the variable."""
        return {p.name: p.variable for p in self.parameters}


def source_parts(
    parts: Sequence[Part], turn: Callable[[np.ndarray], tuple[float, ...]], reserved: Collection[str]
) -> list[SourcePart]:
    """The parts with identifiers of which none is used twice; `turn` gives angles of a (3, 3) rotation."""
    patterns = [pattern(part) for part in parts]
    values = [
        _parameters(part.field) | _placed(part, copies, turn)
        for part, copies in zip(parts, patterns, strict=True)
    ]
    functions = identifiers([part.name for part in parts], reserved)
    wanted = [f"{f}_{name}" for f, own in zip(functions, values, strict=True) for name in own]
    variables = iter(identifiers(wanted, [*reserved, *functions]))
    found = [
        SourcePart(
            f,
            part,
            tuple(
                Parameter(next(variables), name, value, isinstance(part.field, Swept))
                for name, value in own.items()
            ),
            copies,
        )
        for f, part, own, copies in zip(functions, parts, values, patterns, strict=True)
    ]
    return _each_length_once(found)


def _each_length_once(parts: list[SourcePart]) -> list[SourcePart]:
    """Lengths of one name that are equal are typed once: a change of the first changes all."""
    first: dict[tuple[str, str], str] = {}
    result = []
    for part in parts:
        own = []
        for parameter in part.parameters:
            key = parameter.name, literal(parameter.value, "()")
            shared = first.get(key) if parameter.name in _SHARED else None
            own.append(dataclasses.replace(parameter, same_as=shared))
            first.setdefault(key, parameter.variable)
        result.append(dataclasses.replace(part, parameters=tuple(own)))
    return result


def _placed(
    part: Part, copies: Pattern | None, turn: Callable[[np.ndarray], tuple[float, ...]]
) -> dict[str, Value]:
    """What says where the part and its copies are; no turn where there is none."""
    angles = turn(rotation_matrix(part.rotation))
    turned: dict[str, Value] = {"turn": angles} if any(angles) else {}
    if isinstance(copies, Row):
        return {"places": tuple(map(_tidy, copies.places)), **turned}
    if isinstance(copies, Circle):
        start = round(copies.start % (360 / copies.count), 9) % (360 / copies.count)
        begins: dict[str, Value] = {"start": start} if start else {}
        own = {"centre": _tidy(copies.centre), **turned, "count": copies.count, "circle": copies.diameter}
        return own | begins
    if isinstance(copies, Line):
        return {"place": _tidy(copies.place), **turned, "count": copies.count, "step": copies.step}
    if isinstance(copies, Grid):
        counts = tuple(map(float, copies.count))
        return {"middle": _tidy(copies.middle), **turned, "counts": counts, "spacing": copies.spacing}
    if isinstance(copies, Poses):
        poses = ((_tidy(c.translation), turn(rotation_matrix(c.rotation))) for c in copies.copies)
        return {"poses": tuple(poses)}
    placed: dict[str, Value] = {"place": _tidy(part.translation), **turned}
    if copies is not None:
        placed["count"] = copies.count
        if any(copies.centre):
            placed["centre"] = copies.centre
    return placed


def _tidy(place: tuple[float, ...]) -> tuple[float, ...]:
    """Without the dust of rounding beside what is there."""
    least = 1e-12 * max(map(abs, place))
    return tuple(0.0 if abs(v) <= least else v for v in place)


def _parameters(field: Field) -> dict[str, Value]:
    """By name; a quadric's coefficients mean nothing to a reader."""
    if isinstance(field, Swept):
        return swept_parameters(field)
    if isinstance(field, Pipe):
        return pipe_parameters(field)
    if field.quadric() is not None:
        return {}
    return {entry.name: getattr(field, entry.name) for entry in dataclasses.fields(field)}  # type: ignore[arg-type]


def literal(value: Value, brackets: str) -> str:
    """A number, or a list of lists of them, in such brackets."""
    if not isinstance(value, tuple):
        return number(value)
    return f"{brackets[0]}{', '.join(literal(one, brackets) for one in value)}{brackets[1]}"


def drawn(part: Part) -> Approximation | None:
    """A hollow solid, an extrusion, revolution or pipe, or a SuperFrustum as the sources draw it.

    None where a named solid is the same, or where it does not: without volume, with a hole that the dilation
    closes at one end only, or bent about a centre within itself.
    """
    f = part.field
    if isinstance(f, HollowBox | HollowFrustum | Swept | Pipe):
        return Approximation(f, part, 0.0, 0.0)
    if not isinstance(f, SuperFrustum) or exact_solid(f) is not None:
        return None
    longest, half_width = max(*f.size, f.dilation), min(f.size[:2]) / 2
    open_throughout = min(1.0, f.taper) * half_width * f.onion > f.dilation + SAME * longest
    flare = max(0.0, f.taper - 1) * half_width + f.dilation
    angle = f.bulge * math.pi / 2
    folds = (f.size[0] / 2 + flare + SAME * longest) * math.sin(angle) >= f.size[2] / 2
    if f.thinnest < SAME * longest or (f.hollow and not open_throughout) or (angle > 0 and folds):
        return None
    return Approximation(f, part, 0.0, 0.0)


def helper_source(parts: Sequence[SourcePart], kind: type[Field], name: str) -> list[str]:
    """The lines of the file beside this one that draws fields of a kind, where one of the parts is that."""
    if not any(isinstance(part.part.field, kind) for part in parts):
        return []
    return files("partwright.export").joinpath(name).read_text("utf-8").splitlines()


def number(value: float) -> str:
    """Shortest text of twelve digits; no minus before a zero."""
    return f"{value + 0.0:.12g}"


def plain_unions(node: Node) -> Node:
    """Nested unions flattened, but for repeated ones, and assemblies of one child replaced by it."""
    if isinstance(node, Part):
        return node
    children: list[Node] = []
    repeated = {i for repeat in repeats(node) for i in (repeat.first, *repeat.others)}
    for i, child in enumerate(map(plain_unions, node.children)):
        is_union = isinstance(child, Assembly) and child.operation == node.operation == "union"
        inlined = is_union and i not in repeated
        children += child.children if inlined and isinstance(child, Assembly) else (child,)
    return children[0] if len(children) == 1 else dataclasses.replace(node, children=tuple(children))


def children_and_poses(
    node: Assembly, turn: Callable[[np.ndarray], tuple[float, ...]], brackets: str
) -> Iterator[tuple[Node, str, bool]]:
    """The children without those that are copies or images of others, the places and turns of a group and
    these as a list in such brackets, empty where it is not repeated, and whether some of them are mirror
    images: then each has a third entry, 1 where it is first mirrored in the plane x = 0."""
    for child, motions in children_once(node):
        flips = any(motion.mirror for motion in motions)
        poses = tuple(
            (_tidy(m.move.translation), turn(rotation_matrix(m.move.rotation)), *([float(m.mirror)] * flips))
            for m in (Motion(), *motions)
        )
        yield child, literal(poses, brackets) if motions else "", flips
