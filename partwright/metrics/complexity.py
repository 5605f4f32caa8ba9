"""How much there is to an assembly: surface primitives and convexes."""

from __future__ import annotations

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.assembly.placed import placed_quadric
from partwright.assembly.repeated_groups import children_once, parts_once
from partwright.metrics.metric import Metric

_DIGITS = 9


def primitives(node: Assembly | Part, groups_once: bool = False) -> int:
    """`primitives`: leaves of the tree, #P of CAPRI-Net's tables where leaves are quadrics.

    A leaf that repeats counts once, and with `groups_once` also a group that is another's copy or mirror
    image; of `assembly.expanded()` every copy counts, as in those tables.
    """
    return len(parts_once(node) if groups_once else node.parts)


def convexes(node: Assembly | Part, groups_once: bool = False) -> int:
    """`convexes`: intersections and single leaves that unions and differences join, #C of CAPRI-Net's tables.

    What repeats counts once, as in `primitives`.
    An intersection counts once for each convex that its children hold beyond the one that they share.
    """
    if node.is_part:
        return 1
    children = [child for child, _ in children_once(node)] if groups_once else node.children
    counts = [convexes(child, groups_once) for child in children]
    return sum(counts) - (len(counts) - 1 if node.operation == "intersection" else 0)


def distinct_primitives(node: Assembly | Part, groups_once: bool = False) -> int:
    """Different quadrics among the leaves, whichever side of them is inside, and all other leaves.

    A quadric that several convexes share counts once, as a row of CAPRI-Net's P that several columns of its
    selection matrix choose (section 3.1). groups_once: as in `primitives`.
    """
    found: set[tuple[float, ...]] = set()
    others = 0
    for part in parts_once(node) if groups_once else node.parts:
        quadric = placed_quadric(part)
        if quadric is None:
            others += 1
            continue
        row = np.array(quadric.coefficients)
        row = row / row[np.abs(row).argmax()]  # of the same sign, whichever side is inside
        found.add(tuple((row.round(_DIGITS) + 0.0).tolist()))
    return len(found) + others


PRIMITIVES = Metric(lambda pair: primitives(pair.assembly), "lower")
CONVEXES = Metric(lambda pair: convexes(pair.assembly), "lower")
DISTINCT_PRIMITIVES = Metric(lambda pair: distinct_primitives(pair.assembly), "lower")
