"""One leaf of a tree exchanged for several."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from operator import is_

from partwright.assembly.tree import Assembly, Node, Part
from partwright.errors import ParameterError


def exchanged(assembly: Assembly, name: str, parts: Sequence[Part]) -> Assembly:
    """The assembly with `parts` in place of the leaf `name`: together they take part as it did.

    Leaves that come to share a name are renamed, the later ones.

    Raises:
        ParameterError: no leaf has that name, or there are no parts.
    """
    assembly[name]  # which says the names that there are
    if not parts:
        raise ParameterError(f"{name}: expected parts to put in its place, got none")
    result = _exchanged(assembly, name, parts)
    assert isinstance(result, Assembly)
    return result


def with_leaves(node: Assembly, change: Callable[[Part], Part]) -> Assembly:
    """The assembly with each leaf changed; leaves that come to share a name are renamed, the later ones."""
    children = tuple(
        change(child) if isinstance(child, Part) else with_leaves(child, change) for child in node.children
    )
    return dataclasses.replace(node, children=children)


def added(assembly: Assembly, part: Part) -> Assembly:
    """The assembly with one part more, joined to all of it."""
    if assembly.operation == "union":
        return dataclasses.replace(assembly, children=(*assembly.children, part))
    inner = Assembly(assembly.children, assembly.operation)
    return dataclasses.replace(assembly, children=(inner, part), operation="union")


def _exchanged(node: Node, name: str, parts: Sequence[Part]) -> Node:
    if isinstance(node, Part):
        return node
    children: list[Node] = []
    for i, child in enumerate(node.children):
        if not (isinstance(child, Part) and child.name == name):
            children.append(_exchanged(child, name, parts))
        elif node.operation == "union" or (node.operation == "difference" and i > 0):
            children += parts
        else:
            group = Assembly(tuple(parts), blend=child.blend) if len(parts) > 1 else parts[0]
            children.append(group)
    if len(children) == len(node.children) and all(map(is_, children, node.children)):
        return node
    return dataclasses.replace(node, children=tuple(children))
