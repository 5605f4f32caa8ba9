"""Groups that scenes hold once: what is a copy of another group is there as a move of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Node, Similarity
from partwright.assembly.repeated_groups import repeats_among


@dataclass(frozen=True)
class Shared:
    """A node, and those that look like it elsewhere, each with the rigid move that takes the node there."""

    node: Node
    copies: tuple[tuple[Assembly, Similarity], ...] = ()


def shared(nodes: Sequence[Node]) -> list[Shared]:
    """The nodes in order, copies with the first of them.

    Only what looks and says the same is shared: metadata (colours and maps are there) differ for none of the
    leaves, and all of them end, for what does not is cut off where the whole ends.
    """
    copies: dict[int, tuple[tuple[Assembly, Similarity], ...]] = {}
    taken: set[int] = set()
    for repeat in repeats_among(nodes):
        first = nodes[repeat.first]
        if np.isfinite([part.bounds() for part in first.parts]).all():
            found = [
                (i, node, move)
                for i, move in zip(repeat.copies, repeat.moves, strict=True)
                if isinstance(node := nodes[i], Assembly) and _says_the_same(first, node)
            ]
            copies[repeat.first] = tuple((node, move) for _, node, move in found)
            taken |= {i for i, _, _ in found}
    return [Shared(node, copies.get(i, ())) for i, node in enumerate(nodes) if i not in taken]


def _says_the_same(one: Node, other: Node) -> bool:
    if one.metadata != other.metadata:
        return False
    if isinstance(one, Assembly) and isinstance(other, Assembly):
        return all(map(_says_the_same, one.children, other.children))
    return True
