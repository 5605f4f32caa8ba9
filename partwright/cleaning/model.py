"""An assembly as one vector of numbers that equations can bind: places, turns, lengths and ratios."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.checks import Quaternion
from partwright.assembly.rows import as_superfrustum
from partwright.assembly.similarity import quaternion_product, rotation_matrix
from partwright.cleaning.dimensions import Dimension, dimensions, turned_freely, values, with_values
from partwright.cleaning.fold import Fold
from partwright.cleaning.linear import Equations
from partwright.errors import UncleanableError

Floats = NDArray[np.float64]

MOST_COPIES = 500
"""Of parts that are cleaned together: time and memory grow with their square."""
_RATIO_REACH = 0.5  # of the part's size: how far a ratio may move its surface


@dataclass(frozen=True)
class Variable:
    """One entry of the vector."""

    kind: str
    """"place" (of a copy), "number" (of a leaf's field) or "turn" (of a leaf, about its local axes)."""
    leaf: int
    """Whose it is."""
    copy: int
    """Whose place it is; else the first of the leaf."""
    index: int
    """Axis of a place or turn; of a number, which of the field's dimensions."""
    weight: float
    """How far the surface moves, at most, when the entry grows by 1."""
    dimension: Dimension | None = None
    """Of a number."""


@dataclass(frozen=True)
class Model:
    """Leaves whose copies lie each for itself: those of one leaf share its numbers and its turns."""

    assembly: Assembly
    """In own units."""
    rotations: Floats
    """(C, 3, 3) of the copies, local to world, before any turn."""

    @classmethod
    def of(cls, assembly: Assembly) -> Model:
        """Raises UncleanableError where a leaf is no SuperFrustum or named solid or has no size, or there are
        too many."""
        for part in assembly.parts:
            check_cleanable(part)
        copies = [copy for part in assembly.parts for copy in part.copies]
        if len(copies) > MOST_COPIES:
            raise UncleanableError(
                f"{len(copies):,} parts, copies counted; cleaning relates each to all others, and takes at "
                f"most {MOST_COPIES}: clean pieces of the assembly by themselves"
            )
        return cls(assembly, np.stack([rotation_matrix(copy.rotation) for copy in copies]))

    @property
    def leaves(self) -> tuple[Part, ...]:
        return self.assembly.parts

    @cached_property
    def leaf_of(self) -> NDArray[np.int64]:
        """(C,) the leaf of each copy."""
        return np.repeat(np.arange(len(self.leaves)), [len(part.copies) for part in self.leaves])

    @cached_property
    def firsts(self) -> NDArray[np.int64]:
        """(L,) the first copy of each leaf: the part itself."""
        return np.cumsum([0, *(len(part.copies) for part in self.leaves[:-1])])

    @cached_property
    def fold(self) -> Fold:
        return Fold.of(self.assembly)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        found: list[Variable] = []
        for i, part in enumerate(self.leaves):
            first, size = int(self.firsts[i]), size_of(part)
            for c in range(first, first + len(part.copies)):
                found += [Variable("place", i, c, axis, 1.0) for axis in range(3)]
            found += [Variable("turn", i, first, axis, size / 2) for axis in range(3)]
            for k, dimension in enumerate(dimensions(type(part.field))):
                weight = _RATIO_REACH * size if dimension.ratio else 1.0 if dimension.radial else 0.5
                found.append(Variable("number", i, first, k, weight, dimension))
        return tuple(found)

    @cached_property
    def _columns(self) -> dict[tuple[str, int, int], int]:
        return {
            (v.kind, v.copy if v.kind == "place" else v.leaf, v.index): at
            for at, v in enumerate(self.variables)
        }

    def column(self, kind: str, owner: int, index: int) -> int:
        """Where the vector holds an entry; owner: a copy for "place", else a leaf."""
        return self._columns[kind, owner, index]

    def places(self, copy: int) -> list[int]:
        """Columns of a copy's x, y, z."""
        return [self._columns["place", copy, axis] for axis in range(3)]

    def numbers(self, leaf: int) -> list[int]:
        """Columns of a leaf's dimensions."""
        return [
            self._columns["number", leaf, k] for k in range(len(dimensions(type(self.leaves[leaf].field))))
        ]

    def of_leaf(self, leaf: int) -> NDArray[np.bool_]:
        """(n,) which entries belong to a leaf."""
        return np.array([v.leaf == leaf for v in self.variables])

    @cached_property
    def vector(self) -> Floats:
        """(n,) of the assembly as it is."""
        result = np.zeros(len(self.variables))
        for i, part in enumerate(self.leaves):
            for c, copy in enumerate(part.copies, start=int(self.firsts[i])):
                result[self.places(c)] = copy.translation
            result[self.numbers(i)] = values(part.field)
        return result

    @cached_property
    def weights(self) -> Floats:
        return np.array([v.weight for v in self.variables])

    @cached_property
    def blends(self) -> Floats:
        """(C,) own units."""
        return np.array([copy.blend for part in self.leaves for copy in part.copies])

    def freely(self, copy: int) -> str:
        """How a copy's field may be turned without a difference (`turned_freely`)."""
        return turned_freely(self.leaves[int(self.leaf_of[copy])].field)

    def equations(self) -> Equations:
        return Equations.of(self.vector, self.weights)

    def rotation(self, copy: int, vector: Floats) -> Floats:
        """(3, 3) of a copy, its leaf's turn included."""
        turn = vector[[self.column("turn", int(self.leaf_of[copy]), axis) for axis in range(3)]]
        return self.rotations[copy] @ rotated(turn) if turn.any() else self.rotations[copy]

    @cached_property
    def _quaternions(self) -> list[Quaternion]:
        return [quaternion_of(rotation) for rotation in self.rotations]

    def rows(self, vectors: Iterable[Floats], copy: int, centre: Floats, scale: float) -> NDArray[np.float32]:
        """(K, 16) rows of the kernel for one copy by each vector, in the frame (p - centre) * scale.

        Raises ParameterError where a field does not allow its numbers.
        """
        leaf = int(self.leaf_of[copy])
        kind, numbers, places = type(self.leaves[leaf].field), self.numbers(leaf), self.places(copy)
        lengths = np.array([1.0 if d.ratio else scale for d in dimensions(kind)])
        turns = [self.column("turn", leaf, axis) for axis in range(3)]
        result = []
        for vector in vectors:
            field = with_values(kind, vector[numbers] * lengths)
            rotation, turn = self._quaternions[copy], vector[turns]
            if turn.any():
                rotation = quaternion_product(rotation, _turned(turn))
            place = (vector[places] - centre) * scale
            result.append([*place, *rotation, *as_superfrustum(field).parameters(), 0.0])
        return np.array(result, dtype=np.float32)

    def copies(self, vector: Floats, which: Iterable[int]) -> list[Part]:
        """Copies as parts, in own units. Raises ParameterError where a field does not allow its numbers."""
        fields: dict[int, Part] = {}
        result = []
        for c in which:
            leaf = int(self.leaf_of[c])
            if leaf not in fields:
                part = self.leaves[leaf]
                field = with_values(type(part.field), vector[self.numbers(leaf)])
                fields[leaf] = dataclasses.replace(part, field=field, instances=())
            x, y, z = vector[self.places(c)].tolist()
            quaternion = quaternion_of(self.rotation(c, vector))
            result.append(dataclasses.replace(fields[leaf], translation=(x, y, z), rotation=quaternion))
        return result

    def moved(self, vector: Floats) -> Model:
        """The same with these numbers. Raises ParameterError where a field does not allow its numbers."""
        leaves = []
        for i in range(len(self.leaves)):
            own = range(int(self.firsts[i]), int(self.firsts[i]) + len(self.leaves[i].copies))
            leaves.append(joined(self.copies(vector, own)))
        rotations = np.stack([self.rotation(c, vector) for c in range(len(self.rotations))])
        return Model(with_leaves(self.assembly, leaves), rotations)

    def with_leaf(self, leaf: int, copies: Sequence[Part]) -> Model:
        """The same with other copies of one leaf, as many as it has."""
        rotations = self.rotations.copy()
        first = int(self.firsts[leaf])
        rotations[first : first + len(copies)] = [rotation_matrix(copy.rotation) for copy in copies]
        leaves = list(self.leaves)
        leaves[leaf] = joined(copies)
        return Model(with_leaves(self.assembly, leaves), rotations)


def check_cleanable(part: Part) -> None:
    """Raises UncleanableError where a leaf is no SuperFrustum or named solid, or has no size."""
    if part.field.superfrustum() is None:
        raise UncleanableError(
            f"part {part.name!r} is a {part.field.kind}, whose numbers no relation can bind; SuperFrusta, "
            "named solids, extrusions, revolutions and pipes can be cleaned: fit --method solids --clean "
            "makes such"
        )
    if size_of(part) == 0:
        raise UncleanableError(f"part {part.name!r} has no size; take it out, or give it one")


def joined(copies: Sequence[Part]) -> Part:
    """Copies of one field as one part with instances."""
    base, *others = copies
    home = base.pose.inverse()
    moves = [other.pose @ home for other in others]
    return dataclasses.replace(base, instances=tuple(moves))


def with_leaves(assembly: Assembly, leaves: Sequence[Part]) -> Assembly:
    """The tree with other leaves, in order, of the same names."""
    rest = iter(leaves)

    def renewed(node: Assembly) -> Assembly:
        children = tuple(next(rest) if isinstance(c, Part) else renewed(c) for c in node.children)
        return dataclasses.replace(node, children=children)

    return renewed(assembly)


def rotated(turn: Floats) -> Floats:
    """(3, 3) of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def quaternion_of(rotation: Floats) -> Quaternion:
    pose = np.eye(4)
    pose[:3, :3] = rotation
    w, x, y, z = Similarity.from_matrix(pose).rotation
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)


def _turned(turn: Floats) -> Quaternion:
    """Of a rotation vector."""
    angle = float(np.linalg.norm(turn))
    x, y, z = (np.sinc(angle / (2 * np.pi)) / 2 * turn).tolist()
    return float(np.cos(angle / 2)), x, y, z


def size_of(part: Part) -> float:
    """The longest side of its field's box, own units."""
    lower, upper = part.field.bounds()
    return float((upper - lower).max())
