"""Groups that follow one another and are copies, as the assembly file keeps them: one, and moves of it.

Moves are rounded a little above what arithmetic loses, so that a copy that such a move made gives the same
move again, to the bit: files that are read and written stay as they are.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.mirroring import mirrored
from partwright.assembly.similarity import NO_ROTATION, Similarity, quaternion_product, rotation_matrix
from partwright.errors import ParameterError

if TYPE_CHECKING:
    from partwright.assembly.tree import Assembly, Node, Part

_DIGITS = 13  # of moves that are kept; doubles have nearly 16
_SAME = 1e-12  # of the lengths that occur, and of entries of rotations: what rounding takes from copies


@dataclass(frozen=True)
class GroupCopy:
    """One copy of a group: mirrored where the coordinate `mirror` is 0, if it is that, then moved.

    names: of its leaves, depth first; empty where they are those of the group with its number, leg_02.
    """

    move: Similarity
    mirror: str | None = None
    names: tuple[str, ...] = ()

    def of(self, group: Assembly, number: int) -> Assembly:
        """The copy of a group; number: 2 for the first.

        Raises:
            ParameterError: the names are not as many as there are leaves, or a leaf cannot be mirrored.
        """
        names = self.names or numbered_names(group, number)
        if len(names) != len(group.parts):
            raise ParameterError(
                f"names: expected one for each of {len(group.parts)} parts, got {len(names)}"
            )
        image = group if self.mirror is None else mirrored(group, self.mirror, suffix="")
        return with_names(image.transformed(self.move), names)


def numbered_names(group: Assembly, number: int) -> tuple[str, ...]:
    """What leaves of a copy are called unless they are named: leg_02, hole_02."""
    return tuple(f"{part.name}_{number:02d}" for part in group.parts)


def with_names(group: Assembly, names: Sequence[str]) -> Assembly:
    """The group with its leaves called so, depth first."""
    left = iter(names)

    def renamed(node: Assembly) -> Assembly:
        children = tuple(
            dataclasses.replace(child, name=next(left)) if child.is_part else renamed(child)
            for child in node.children
        )
        return dataclasses.replace(node, children=children)

    return renamed(group)


def settled(group: Assembly, move: Similarity) -> Similarity:
    """The rigid move, rounded so that it is seen again from where it takes the group."""
    return _move(group.parts[0], group.parts[0].transformed(move))


def in_runs(node: Assembly) -> list[tuple[Node, tuple[GroupCopy, ...]]]:
    """The children, without groups that are copies of the one before; these as copies of that.

    Of a difference the first child stands for itself, and all do in an intersection.
    """
    result: list[tuple[Node, tuple[GroupCopy, ...]]] = []
    for i, child in enumerate(node.children):
        alone = node.operation == "intersection" or (node.operation == "difference" and i < 2)
        if result and not alone and not child.is_part and not (first := result[-1][0]).is_part:
            copies = result[-1][1]
            copy = _copy(first, child, len(copies) + 2)
            if copy is not None:
                result[-1] = first, (*copies, copy)
                continue
        result.append((child, ()))
    return result


def _copy(group: Assembly, other: Assembly, number: int) -> GroupCopy | None:
    """What makes the other of the group, but for rounding; None where nothing does."""
    if not may_be_copies(group, other):
        return None
    names = tuple(part.name for part in other.parts)
    if names == numbered_names(group, number):
        names = ()
    copy = _by(group, other, None, names, number)
    if copy is not None:
        return copy
    images = [image for axis in "xyz" if (image := _by(group, other, axis, names, number))]
    return min(images, key=lambda image: image.move.rotation != NO_ROTATION, default=None)


def _by(
    group: Assembly, other: Assembly, mirror: str | None, names: tuple[str, ...], number: int
) -> GroupCopy | None:
    """The copy, if it is one by such a mirror, or by none."""
    try:
        image = group if mirror is None else mirrored(group, mirror, suffix="")
    except ParameterError:  # a learned part
        return None
    copy = GroupCopy(_move(image.parts[0], other.parts[0]), mirror, names)
    made = copy.of(group, number)
    size = max(abs(v) for part in (*made.parts, *other.parts) for v in part.translation)
    again = _move(image.parts[0], made.parts[0]) == copy.move
    return copy if again and _same(made, other, _SAME * size) else None


def may_be_copies(one: Node, other: Node) -> bool:
    """Whether two nodes may be copies, seen from their forms alone."""
    if one.is_part and other.is_part:
        return one.field.kind == other.field.kind
    if one.is_part or other.is_part or len(one.children) != len(other.children):
        return False
    return one.operation == other.operation and all(map(may_be_copies, one.children, other.children))


def _same(one: Node, other: Node, near: float) -> bool:
    """Whether two nodes are equal, places within `near` of one another."""
    if (one.name, one.blend, one.metadata) != (other.name, other.blend, other.metadata):
        return False
    if one.is_part and other.is_part:
        return (
            one.field == other.field
            and same_place(one, other, _SAME, near)
            and len(one.instances) == len(other.instances)
            and all(
                same_place(m, n, _SAME, near) for m, n in zip(one.instances, other.instances, strict=True)
            )
        )
    if one.is_part or other.is_part or (one.unit, one.up) != (other.unit, other.up):
        return False
    return all(_same(a, b, near) for a, b in zip(one.children, other.children, strict=True))


def same_place(one: Part | Similarity, other: Part | Similarity, turned: float, near: float) -> bool:
    """Whether rigid poses are the same: entries of rotations within `turned`, places within `near`."""
    off = np.abs(rotation_matrix(one.rotation) - rotation_matrix(other.rotation)).max()
    return bool(off < turned and np.abs(np.subtract(one.translation, other.translation)).max() <= near)


def _move(one: Part, other: Part) -> Similarity:
    """From one part to the other, rounded."""
    w, x, y, z = one.rotation
    turn = quaternion_product(other.rotation, (w, -x, -y, -z))
    largest = max(turn, key=abs)
    # Shares of the largest are whole for turns that are drawn, and survive that they are made a unit again.
    shares = [round(v / largest, _DIGITS) for v in turn]
    size = math.copysign(math.hypot(*shares), largest)
    w, x, y, z = (v / size + 0.0 for v in shares)
    rotation = (w, x, y, z)
    offset = np.subtract(other.translation, rotation_matrix(rotation) @ one.translation)
    reach = max(map(abs, (*one.translation, *other.translation)))
    digits = _DIGITS + 1 - math.ceil(math.log10(reach)) if reach > 0 else 0
    x, y, z = (round(v, digits) + 0.0 for v in offset.tolist())
    return Similarity(1.0, rotation, (x, y, z))
