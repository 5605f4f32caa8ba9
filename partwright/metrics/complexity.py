"""How much there is to an assembly: surface primitives and convexes."""

from __future__ import annotations

from partwright.assembly import Assembly, Part


def primitives(node: Assembly | Part) -> int:
    """`primitives`: leaves of the tree, #P of CAPRI-Net's tables where leaves are quadrics.

    What repeats counts once; of `assembly.expanded()` every copy counts, as in those tables.
    """
    return 1 if isinstance(node, Part) else len(node)


def convexes(node: Assembly | Part) -> int:
    """`convexes`: intersections and single leaves that unions and differences join, #C of CAPRI-Net's tables.

    What repeats counts once, as in `primitives`.
    An intersection counts once for each convex that its children hold beyond the one that they share.
    """
    if isinstance(node, Part):
        return 1
    counts = [convexes(child) for child in node.children]
    return sum(counts) - (len(counts) - 1 if node.operation == "intersection" else 0)
