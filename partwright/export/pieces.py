"""What a format without blends and holes takes one by one: the solids that an assembly is the union of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.names import unique_names
from partwright.assembly.palette import palette
from partwright.assembly.tree import operands


@dataclass(frozen=True)
class Piece:
    """A part, or a difference or intersection, which is taken as a whole.

    name: unique among the pieces. colour: (3,) sRGB, 0..1. blend: with which it melts into those before it.
    """

    node: Node
    name: str
    colour: np.ndarray
    blend: float

    @property
    def part_names(self) -> tuple[str, ...]:
        return (self.node.name,) if isinstance(self.node, Part) else tuple(p.name for p in self.node.parts)


def pieces(assembly: Assembly) -> list[Piece]:
    """In the order in which they are joined; each copy of a repeated part is one."""
    colours = dict(zip((p.name for p in assembly.parts), palette(len(assembly)) / 255, strict=True))
    opened = list(_opened(assembly, 0.0))
    names = unique_names([_name(node) for node, _ in opened], ["piece"] * len(opened))
    return [
        Piece(node, name, colours[node.name if isinstance(node, Part) else node.parts[0].name], blend)
        for (node, blend), name in zip(opened, names, strict=True)
    ]


def _opened(node: Node, blend: float) -> Iterator[tuple[Node, float]]:
    """The first child of a union melts in as the union itself does."""
    if isinstance(node, Assembly) and node.operation == "union":
        for i, child in enumerate(operands(node)):
            yield from _opened(child, child.blend if i else blend)
    else:
        yield node, blend


def _name(node: Node) -> str:
    return node.name or (node.parts[0].name if isinstance(node, Assembly) else "")
