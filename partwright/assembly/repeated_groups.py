"""Groups that are repeated: subtrees of which others are rigid copies, such as a foot and its hole.

Copies are nodes like any other, so all that reads a tree reads them right; that they are copies is seen from
their fields and places. Edits, descriptions and sources tell it by `repeats` and say each group once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.group_copies import GroupCopy, may_be_copies, same_place, settled
from partwright.assembly.mirroring import mirrored
from partwright.assembly.motion import Motion
from partwright.assembly.similarity import Similarity
from partwright.errors import ParameterError

if TYPE_CHECKING:
    from partwright.assembly.tree import Assembly, Node, Part

_SAME = 1e-9  # of the lengths that occur, and of entries of rotations


@dataclass(frozen=True)
class Repeat:
    """Children of a node: `first`, its copies, each by a rigid move, and its mirror images, each mirrored in
    the plane x = 0 and then moved."""

    first: int
    copies: tuple[int, ...]
    moves: tuple[Similarity, ...]
    images: tuple[int, ...] = ()
    moves_of_images: tuple[Similarity, ...] = ()

    @property
    def others(self) -> tuple[int, ...]:
        """All but the first, copies before images."""
        return (*self.copies, *self.images)

    @property
    def motions(self) -> tuple[Motion, ...]:
        """What takes the first to each of the others."""
        return (*map(Motion, self.moves), *(Motion(move, True) for move in self.moves_of_images))


def line(count: int, step: Sequence[float]) -> tuple[Similarity, ...]:
    """The moves of `count` in a line, (count - 1,), each a step (3,) further than the one before.

    Raises:
        ParameterError: the count is no whole number, or less than 2.
    """
    _check(count)
    x, y, z = (float(v) for v in step)
    return tuple(Similarity(translation=(i * x, i * y, i * z)) for i in range(1, count))


def ring(count: int, axis: str = "z", centre: Sequence[float] = (0.0, 0.0, 0.0)) -> tuple[Similarity, ...]:
    """The moves of `count` by equal turns about an axis "x", "y" or "z" through a centre (3,), (count - 1,).

    Raises:
        ParameterError: the count is no whole number, or less than 2, or there is no such axis.
    """
    _check(count)
    if axis not in ("x", "y", "z"):
        raise ParameterError(f"axis: expected x, y or z, got {axis!r}")
    direction = np.eye(3)["xyz".index(axis)].tolist()
    return tuple(Similarity.turn(direction, 2 * math.pi * i / count, centre) for i in range(1, count))


def _check(count: int) -> None:
    if isinstance(count, bool) or not isinstance(count, int) or count < 2:
        raise ParameterError(f"count: expected a whole number, at least 2, got {count!r}")


def copies_of(group: Assembly, moves: Sequence[Similarity]) -> tuple[Assembly, ...]:
    """The group moved by each of the moves; leaves of the first copy are called NAME_02, and so on.

    Raises:
        ParameterError: a move scales.
    """
    scales = [move.scale for move in moves if abs(move.scale - 1) > 1e-9]
    if scales:
        raise ParameterError(f"a move scales by {scales[0]:g}; copies of a group are as large as it is")
    return tuple(GroupCopy(settled(group, move)).of(group, i) for i, move in enumerate(moves, start=2))


def repeats(node: Node) -> list[Repeat]:
    """Groups among the children of a node that stand for one another, mirror images among them; in a
    difference not its first child."""
    if node.is_part:
        return []
    return repeats_among(node.children, 1 if node.operation == "difference" else 0, images=True)


def repeats_among(nodes: Sequence[Node], first: int = 0, images: bool = False) -> list[Repeat]:
    """Groups among nodes, from the given one on, that stand for one another; images: mirror images, too."""
    left = [i for i, node in enumerate(nodes) if i >= first and not node.is_part]
    found = []
    while left:
        own, *others = left
        moves = {i: move_between(nodes[own], nodes[i]) for i in others}
        copies = {i: move for i, move in moves.items() if move is not None}
        group, rest = nodes[own], [i for i in others if i not in copies]
        image = _image(group, [nodes[i] for i in rest]) if images and not group.is_part else None
        seen = {i: move_between(image, nodes[i]) for i in rest} if image is not None else {}
        mirrored_ones = {i: move for i, move in seen.items() if move is not None}
        if copies or mirrored_ones:
            by = (tuple(one) for one in (copies, copies.values(), mirrored_ones, mirrored_ones.values()))
            found.append(Repeat(own, *by))  # type: ignore[arg-type]
        left = [i for i in rest if i not in mirrored_ones]
    return found


def _image(group: Assembly, others: Sequence[Node]) -> Assembly | None:
    """The mirror image of a group in the plane x = 0; None where none of the others can be that."""
    if not any(may_be_copies(group, other) for other in others):
        return None
    try:
        return mirrored(group, "x", suffix="")
    except ParameterError:  # a learned part
        return None


def children_once(node: Assembly) -> list[tuple[Node, tuple[Motion, ...]]]:
    """The children of a node without those that are copies or mirror images of others, each with the motions
    to these. Those of an intersection are all told: what is there several times reads as united."""
    found = {repeat.first: repeat for repeat in repeats(node)} if node.operation != "intersection" else {}
    others = {i for repeat in found.values() for i in repeat.others}
    return [
        (child, found[i].motions if i in found else ())
        for i, child in enumerate(node.children)
        if i not in others
    ]


def parts_once(node: Node) -> tuple[Part, ...]:
    """The leaves of a tree, without those of groups that are copies or mirror images of others."""
    if node.is_part:
        return (node,)
    return tuple(part for child, _ in children_once(node) for part in parts_once(child))


def move_between(one: Node, other: Node) -> Similarity | None:
    """The rigid move that takes a node to another of the same fields in the same tree; None where none."""
    leaves: list[tuple[Part, Part]] = []
    for pair in _pairs(one, other):
        if pair is None:
            return None
        leaves.append(pair)
    a, b = leaves[0]
    move = b.pose @ a.pose.inverse()
    size = 1.0 + float(np.abs([part.translation for pair in leaves for part in pair]).max())
    for a, b in leaves:
        moved = a.transformed(move)
        if not same_place(moved, b, _SAME, _SAME * size) or not all(
            same_place(m, n, _SAME, _SAME * size) for m, n in zip(moved.instances, b.instances, strict=True)
        ):
            return None
    return move


def _pairs(one: Node, other: Node) -> Iterator[tuple[Part, Part] | None]:
    """Leaves that stand for one another; None where the nodes differ."""
    if one.is_part and other.is_part:
        alike = one.field == other.field and one.blend == other.blend
        yield (one, other) if alike and len(one.instances) == len(other.instances) else None
    elif one.is_part or other.is_part or _form(one) != _form(other):
        yield None
    else:
        for a, b in zip(one.children, other.children, strict=True):
            yield from _pairs(a, b)


def _form(node: Assembly) -> tuple[str, float, int]:
    return node.operation, node.blend, len(node.children)


def alike_leaves(node: Node) -> dict[str, tuple[tuple[str, Motion], ...]]:
    """By the name of a leaf: those in its place in copies and images of its group, and the motions there."""
    found: dict[str, tuple[tuple[str, Motion], ...]] = {}
    if node.is_part:
        return found
    for child in node.children:
        found |= alike_leaves(child)
    within = dict(found)
    for repeat in repeats(node):
        groups = [node.children[i] for i in (repeat.first, *repeat.others)]
        moves = [Motion(), *repeat.motions]
        for leaves in zip(*(group.parts for group in groups), strict=True):
            for k, leaf in enumerate(leaves):
                back = moves[k].inverse()
                others = [(o.name, moves[i] @ back) for i, o in enumerate(leaves) if i != k]
                # What is alike within a copy is alike in all of them.
                further = [(far, on @ move) for name, move in others for far, on in within.get(name, ())]
                found[leaf.name] = (*within.get(leaf.name, ()), *others, *further)
    return found
