"""A difference of several solids as the union of their differences, and nodes as solids of manifold3d."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError
from partwright.meshing import mesh_assembly, mesh_part
from partwright.meshing.csg import has_exact_mesh, solid_of
from partwright.meshing.thin_parts import as_manifold

if TYPE_CHECKING:
    from manifold3d import Manifold

_CELLS = 48  # along what has no exact mesh


def separated(node: Node) -> Iterator[Node]:
    """Nodes whose union is the node: a difference of a union is the union of its children's differences, each
    with what cuts into it; a child that nothing cuts into is itself again."""
    if not isinstance(node, Assembly) or node.operation == "intersection":
        yield node
    elif node.operation == "union":
        for child in node.operands:
            yield from separated(child)
    else:
        first, *cutters = node.operands
        for child in separated(first):
            cutting = [cutter for cutter in cutters if _common(child, cutter, None) is not None]
            yield Assembly((child, *cutting), "difference", child.name) if cutting else child


def subtracted_names(node: Node) -> frozenset[str]:
    """Names of the parts that a node takes away: what a difference subtracts, less what that subtracts
    itself."""
    if isinstance(node, Part):
        return frozenset()
    if node.operation != "difference":
        return frozenset().union(*map(subtracted_names, node.children))
    first, *cutters = node.children
    taken = {part.name for cutter in cutters for part in cutter.parts}
    back = frozenset().union(*map(subtracted_names, cutters))
    return subtracted_names(first) | (taken - back)


def _common(a: Node, b: Node, tolerance: float | None) -> Manifold | None:
    """What two nodes have in common, one of them perhaps endless; None where that is nothing."""
    try:
        both = Assembly((a, b), "intersection")
        solid = (
            solid_of(both, tolerance) if has_exact_mesh(both) else node_solid(a, None) ^ node_solid(b, None)
        )
    except NoSurfaceError:
        return None
    return None if solid.is_empty() or solid.volume() <= 0 else solid


def node_solid(node: Node, tolerance: float | None) -> Manifold:
    """The solid of a node; tolerance: how far a chord may lie from its curved surface, in own units.

    Raises:
        NoSurfaceError: it has no volume, or no end.
    """
    if has_exact_mesh(node):
        return solid_of(node, tolerance)
    return as_manifold(mesh_part(node, _CELLS) if isinstance(node, Part) else mesh_assembly(node, _CELLS))
