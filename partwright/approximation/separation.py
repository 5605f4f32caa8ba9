"""A difference of several solids as the union of their differences, and nodes as solids of manifold3d."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError
from partwright.meshing import mesh_assembly, mesh_part
from partwright.meshing.assemblies import lipschitz
from partwright.meshing.blocks import subdivided
from partwright.meshing.csg import has_exact_mesh, solid_of
from partwright.meshing.manifolds import as_manifold

if TYPE_CHECKING:
    from manifold3d import Manifold

_CELLS = 48  # along what has no exact mesh
_BLURRED = 3e-3  # of the longest side: what their solids may be off
_HALVINGS = 5


def separated(node: Node) -> Iterator[Node]:
    """Nodes whose union is the node: a difference of a union is the union of its children's differences, each
    with what cuts into it; a child that nothing cuts into is itself again."""
    yield from _separated(node, _Meetings())


def _separated(node: Node, meetings: _Meetings) -> Iterator[Node]:
    if not isinstance(node, Assembly) or node.operation == "intersection":
        yield node
    elif node.operation == "union":
        for child in node.operands:
            yield from _separated(child, meetings)
    else:
        first, *cutters = node.operands
        for child in _separated(first, meetings):
            cutting = [cutter for cutter in cutters if meetings.of(child, cutter)]
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


class _Meetings:
    """Which nodes have volume in common. Each is meshed once, however many others it is held against."""

    def __init__(self) -> None:
        self.known: dict[int, tuple[Node, Manifold | None]] = {}  # by identity, so the node must live on

    def of(self, a: Node, b: Node) -> bool:
        """Whether two nodes, one of them perhaps endless, have volume in common."""
        (low_a, high_a), (low_b, high_b) = a.bounds(), b.bounds()
        low, high = np.maximum(low_a, low_b), np.minimum(high_a, high_b)
        if (low >= high).any():
            return False
        both = Assembly((a, b), "intersection")
        if has_exact_mesh(both):
            common = _solid_or_nothing(both)
        else:
            longest = float(max((high_a - low_a).max(), (high_b - low_b).max()))
            # A quadric's distance may be steep without end.
            known = None if has_exact_mesh(a) or has_exact_mesh(b) else _meet(a, b, low, high, longest)
            if known is not None:
                return known
            one, other = self.solid(a), self.solid(b)
            common = None if one is None or other is None else one ^ other
        return common is not None and not common.is_empty() and common.volume() > 0

    def solid(self, node: Node) -> Manifold | None:
        if id(node) not in self.known:
            self.known[id(node)] = node, _solid_or_nothing(node)
        return self.known[id(node)][1]


def _meet(a: Node, b: Node, low: np.ndarray, high: np.ndarray, longest: float) -> bool | None:
    """Whether two nodes have volume in common within a box, as their distances tell in ever smaller parts of
    it; None where they are so near to each other that their solids have the word.

    longest: side of the larger one.
    """
    steep, blurred = max(lipschitz(a), lipschitz(b)), _BLURRED * longest
    boxes, side = np.zeros((1, 3), np.int64), high - low
    for _ in range(_HALVINGS):
        side = side / 2
        boxes = subdivided(boxes)
        places = low + side * (boxes + 0.5)
        outside = np.maximum(a.distance(places), b.distance(places))
        if (outside < -blurred).any():
            return True
        boxes = boxes[outside < steep * np.linalg.norm(side) / 2 + blurred]
        if not len(boxes):
            return False
    return None


def _solid_or_nothing(node: Node) -> Manifold | None:
    try:
        return node_solid(node, None)
    except NoSurfaceError:
        return None


def node_solid(node: Node, tolerance: float | None) -> Manifold:
    """The solid of a node; tolerance: how far a chord may lie from its curved surface, in own units.

    Raises:
        NoSurfaceError: it has no volume, or no end.
    """
    if has_exact_mesh(node):
        return solid_of(node, tolerance)
    return as_manifold(mesh_part(node, _CELLS) if isinstance(node, Part) else mesh_assembly(node, _CELLS))
