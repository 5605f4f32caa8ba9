"""`Part` and `Assembly`: what every method returns. Immutable; every edit returns a new one."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, TypeAlias, TypeVar

import numpy as np

from partwright.assembly.bounding_box import bounding_box
from partwright.assembly.checks import (
    Quaternion,
    Vector,
    blend_width,
    flat_metadata,
    printable_name,
    unit_quaternion,
    vector,
)
from partwright.assembly.description import describe
from partwright.assembly.display import DISPLAYS
from partwright.assembly.distance import distance, nearest_parts, part_distances, unit_similarity
from partwright.assembly.file_text import save
from partwright.assembly.joint import joined
from partwright.assembly.names import unique_names
from partwright.assembly.similarity import (
    NO_ROTATION,
    ORIGIN,
    Similarity,
    quaternion_product,
    rigid_moves,
)
from partwright.errors import ParameterError
from partwright.fields import Field

if TYPE_CHECKING:
    from pathlib import Path

Operation: TypeAlias = Literal["union", "intersection", "difference"]
OPERATIONS: tuple[Operation, ...] = ("union", "intersection", "difference")
MAX_DEPTH = 64

Array = TypeVar("Array", bound=Any)


class _Common(ABC):
    """What parts and assemblies can both do. `a | b`, `a - b`, `a & b`: union, difference, intersection."""

    def __or__(self, other: Node) -> Assembly:
        return _combine("union", self, other)

    def __sub__(self, other: Node) -> Assembly:
        return _combine("difference", self, other)

    def __and__(self, other: Node) -> Assembly:
        return _combine("intersection", self, other)

    @abstractmethod
    def transformed(self, similarity: Similarity) -> Self:
        """Turned, scaled and moved."""

    def scaled(self, factor: float) -> Self:
        """Scaled about the origin by a positive factor: places, sizes, dilations and blends alike."""
        return self.transformed(Similarity(scale=factor))

    def translated(self, offset: Sequence[float]) -> Self:
        """Moved by an offset (3,)."""
        return self.transformed(Similarity(translation=vector(offset, "offset")))

    def bounds(self) -> np.ndarray:
        """(2, 3) lowest and highest corner, float64."""
        return self._box.copy()

    @cached_property
    def _box(self) -> np.ndarray:
        return bounding_box(self)  # type: ignore[arg-type]

    @cached_property
    def _normalised(self) -> tuple[Similarity, Self]:
        frame = unit_similarity(self)  # type: ignore[arg-type]
        return frame, self.transformed(frame)

    def describe(self, digits: int = 4) -> str:
        """The tree in words and numbers, a line a node."""
        return describe(self, digits)  # type: ignore[arg-type]

    def distance(self, points: Array) -> Array:
        """Signed distance (N,) at points (N, 3), negative inside, in the points' own dtype.

        A torch tensor is answered by the differentiable reference, anything else by the kernel.
        """
        return distance(self, points)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Part(_Common):
    """A field with a pose and a name: one leaf of an assembly.

    Args:
        field: the solid in its local frame (a `SuperFrustum` or a named solid).
        translation: place of the local origin.
        rotation: unit quaternion (w, x, y, z), local to world.
        blend: width over which this part melts into the parts before it; 0 is a sharp edge.
        name: unique within an assembly; the assembly names it if it is empty.
        metadata: what else is known of it, strings and numbers.
        instances: rigid moves (similarities of scale 1) of the posed part in the assembly's own frame; each
            makes one further copy. The part itself is always there and is not listed.

    A repeated part is one leaf: the union of its copies, each melting in over `blend` like a part by itself.

    Raises:
        ParameterError: a value is not finite, the rotation has no length, the blend is negative, or an
            instance is no rigid move.
    """

    is_part: ClassVar[Literal[True]] = True

    field: Field
    translation: Vector = ORIGIN
    rotation: Quaternion = NO_ROTATION
    blend: float = 0.0
    name: str = ""
    metadata: Mapping[str, str | float] = dataclasses.field(default_factory=dict, hash=False)
    instances: tuple[Similarity, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.field, Field):
            raise ParameterError(f"field: expected a field such as SuperFrustum, got {self.field!r:.80}")
        object.__setattr__(self, "translation", vector(self.translation, "translation"))
        object.__setattr__(self, "rotation", unit_quaternion(self.rotation, "rotation"))
        object.__setattr__(self, "instances", rigid_moves(self.instances, "instances"))
        _check_common(self)

    @property
    def operation(self) -> Operation:
        """A part is the union of its copies."""
        return "union"

    @property
    def operands(self) -> tuple[Part, ...]:
        """What the operation folds: its copies."""
        return self.copies

    @property
    def parts(self) -> tuple[Part, ...]:
        """The part itself."""
        return (self,)

    @property
    def pose(self) -> Similarity:
        """Of the part without its instances."""
        return Similarity(1.0, self.rotation, self.translation)

    @cached_property
    def copies(self) -> tuple[Part, ...]:
        """The part itself and a moved copy an instance, all of the same name, none of them repeated."""
        alone = dataclasses.replace(self, instances=()) if self.instances else self
        return (alone, *(alone.transformed(move) for move in self.instances))

    def transformed(self, similarity: Similarity) -> Part:
        """The part turned, scaled and moved, with all its copies."""
        return dataclasses.replace(
            self,
            field=self.field if similarity.scale == 1.0 else self.field.scaled(similarity.scale),
            translation=tuple(similarity(np.array(self.translation)).tolist()),
            rotation=quaternion_product(similarity.rotation, self.rotation),
            blend=self.blend * similarity.scale,
            instances=tuple(similarity.conjugate(move) for move in self.instances),
        )


@dataclass(frozen=True)
class Assembly(_Common):
    """Parts and assemblies joined by an operation.

    A union is folded first to last, each child but the first melting into what came before over its own
    blend. A difference is the first child minus the others, an intersection what all share; blends round
    their edges in the same way.

    Args:
        children: parts and assemblies, at least one. Leaves that are unnamed, or share a name, are renamed.
        operation: "union", "intersection" or "difference".
        name: of this node; may be empty.
        blend: of this node within the assembly that holds it.
        unit: the length unit of all numbers ("mm", "m" ...), None where unknown.
        up: the axis that points up ("x", "y", "z", "-x" ...), None where unknown.
        metadata: what else is known, strings and numbers: {"source": "mug.glb"}.

    Raises:
        ParameterError: no children, an unknown operation, nested more than 64 deep, or a bad number.
    """

    is_part: ClassVar[Literal[False]] = False

    children: tuple[Node, ...]
    operation: Operation = "union"
    name: str = ""
    blend: float = 0.0
    unit: str | None = None
    up: str | None = None
    metadata: Mapping[str, str | float] = dataclasses.field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        children = tuple(self.children)
        if not children:
            raise ParameterError("an assembly needs at least one part, got none")
        for child in children:
            if not isinstance(child, Part | Assembly):
                raise ParameterError(f"children: expected parts and assemblies, got {type(child).__name__}")
        if self.operation not in OPERATIONS:
            raise ParameterError(
                f"operation: expected one of {', '.join(OPERATIONS)}, got {self.operation!r}"
            )
        for label in ("unit", "up"):
            if not isinstance(getattr(self, label), str | None):
                raise ParameterError(f"{label}: expected a string or None, got {getattr(self, label)!r}")
        _check_common(self)
        object.__setattr__(self, "children", joined(_with_unique_names(children)))
        if self.depth > MAX_DEPTH:
            raise ParameterError(f"assemblies nest at most {MAX_DEPTH} deep, got {self.depth}")

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The leaves, depth first."""
        return tuple(part for child in self.children for part in child.parts)

    @cached_property
    def operands(self) -> tuple[Node, ...]:
        """What the operation folds, in order: the children; in a union, repeated parts as their copies."""
        if self.operation != "union":
            return self.children
        return tuple(c for child in self.children for c in (child.copies if child.is_part else (child,)))

    @cached_property
    def depth(self) -> int:
        """1 for an assembly of parts alone."""
        return 1 + max((child.depth for child in self.children if not child.is_part), default=0)

    def __len__(self) -> int:
        return len(self.parts)

    def __getitem__(self, name: str) -> Part:
        """The leaf of that name."""
        self._require(name)
        return next(part for part in self.parts if part.name == name)

    def part_distances(self, points: np.ndarray) -> np.ndarray:
        """(M, N) signed distance of each leaf alone, unblended, to its nearest copy, at points (N, 3)."""
        return part_distances(self, points)

    def nearest_parts(self, points: np.ndarray) -> np.ndarray:
        """(N,) index into `parts` of the leaf that each point (N, 3) lies deepest in or nearest to."""
        return nearest_parts(self, points)

    def transformed(self, similarity: Similarity) -> Assembly:
        """The assembly turned, scaled and moved as a whole."""
        children = tuple(child.transformed(similarity) for child in self.children)
        return dataclasses.replace(self, children=children, blend=self.blend * similarity.scale)

    def expanded(self) -> Assembly:
        """The same solid with every copy of a repeated part as a part of its own (named leg, leg_02 ...)."""
        nodes = (node if node.is_part else node.expanded() for node in self.operands)
        return dataclasses.replace(self, children=tuple(map(_without_instances, nodes)))

    def renamed(self, old: str, new: str) -> Assembly:
        """The leaf `old` under a new name.

        Raises:
            ParameterError: no leaf is named `old`, or another is already named `new`.
        """
        if new != old and any(part.name == new for part in self.parts):
            raise ParameterError(f"a part named {new!r} is already there")
        return self.replace_part(old, dataclasses.replace(self[old], name=new))

    def replace_part(self, name: str, part: Part) -> Assembly:
        """The leaf `name` replaced; an unnamed replacement keeps the name."""
        self._require(name)
        part = dataclasses.replace(part, name=part.name or name)
        return _require_some(self._edited(lambda leaf: part if leaf.name == name else leaf))

    def without(self, name: str) -> Assembly:
        """All but the leaf `name`. Where a difference loses its first child, nothing of it is left.

        Raises:
            ParameterError: no leaf has that name, or nothing would be left.
        """
        self._require(name)
        return _require_some(self._edited(lambda leaf: None if leaf.name == name else leaf))

    def save(self, path: str | Path) -> None:
        """Write the assembly file (docs/assembly-file.md); `load_assembly` gives the same assembly back.

        Raises:
            OutputError: the file cannot be written.
        """
        save(self, path)

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        """What notebooks show: the page of the studio, and a still picture where they strip HTML."""
        return DISPLAYS["notebook"](self)

    def _require(self, name: str) -> None:
        names = [part.name for part in self.parts]
        if name not in names:
            shown = ", ".join(names[:20]) + (" ..." if len(names) > 20 else "")
            raise ParameterError(f"no part is named {name!r}; the names are: {shown}")

    def _edited(self, edit: Callable[[Part], Part | None]) -> Assembly | None:
        edited = [edit(c) if c.is_part else c._edited(edit) for c in self.children]
        if all(new is old for new, old in zip(edited, self.children, strict=True)):
            return self
        if self.operation == "difference" and edited[0] is None:
            return None
        children = tuple(child for child in edited if child is not None)
        return dataclasses.replace(self, children=children) if children else None


Node: TypeAlias = Part | Assembly


def _without_instances(node: Node) -> Node:
    if node.is_part and node.instances:
        return Assembly(node.copies, blend=node.blend)
    return node


def _combine(operation: Operation, a: Any, b: Any) -> Assembly:
    """An unnamed `a` of the same operation is continued: the fold runs left to right anyway."""
    if not isinstance(b, Part | Assembly):
        return NotImplemented
    known: dict[str, str | None] = {}
    for label in ("unit", "up"):
        values = {v for node in (a, b) if (v := getattr(node, label, None)) is not None}
        if len(values) > 1:
            raise ParameterError(
                f"{label}: one assembly has {a.__dict__[label]!r}, the other {b.__dict__[label]!r}"
            )
        known[label] = values.pop() if values else None
    continued = isinstance(a, Assembly) and a.operation == operation and not a.name
    return Assembly((*a.children, b) if continued else (a, b), operation, unit=known["unit"], up=known["up"])


def _check_common(node: Node) -> None:
    """What parts and assemblies share. `object.__setattr__` is how a frozen dataclass sets its own."""
    object.__setattr__(node, "name", printable_name(node.name))
    object.__setattr__(node, "blend", blend_width(node.blend))
    object.__setattr__(node, "metadata", flat_metadata(node.metadata))


def _with_unique_names(children: tuple[Node, ...]) -> tuple[Node, ...]:
    leaves = [part for child in children for part in child.parts]
    wanted = [leaf.name for leaf in leaves]
    if all(wanted) and len(set(wanted)) == len(wanted):
        return children
    names = iter(unique_names(wanted, [leaf.field.stem for leaf in leaves]))

    def rename(node: Node) -> Node:
        if not node.is_part:
            return dataclasses.replace(node, children=tuple(rename(child) for child in node.children))
        name = next(names)
        return node if name == node.name else dataclasses.replace(node, name=name)

    return tuple(rename(child) for child in children)


def _require_some(assembly: Assembly | None) -> Assembly:
    if assembly is None:
        raise ParameterError("nothing would be left: an assembly needs at least one part")
    return assembly
