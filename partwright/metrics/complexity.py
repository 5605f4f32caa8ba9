"""How much there is to an assembly: surface primitives and convexes."""

from __future__ import annotations

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.assembly.placed import placed_quadric
from partwright.metrics.metric import Metric

_DIGITS = 9


def primitives(node: Assembly | Part) -> int:
    """`primitives`: leaves of the tree, #P of CAPRI-Net's tables where leaves are quadrics.

    What repeats counts once; of `assembly.expanded()` every copy counts, as in those tables.
    """
    return len(node.parts)


def convexes(node: Assembly | Part) -> int:
    """`convexes`: intersections and single leaves that unions and differences join, #C of CAPRI-Net's tables.

    What repeats counts once, as in `primitives`.
    An intersection counts once for each convex that its children hold beyond the one that they share.
    """
    if node.is_part:
        return 1
    counts = [convexes(child) for child in node.children]
    return sum(counts) - (len(counts) - 1 if node.operation == "intersection" else 0)


def distinct_primitives(node: Assembly | Part) -> int:
    """Different quadrics among the leaves, whichever side of them is inside, and all other leaves.

    A quadric that several convexes share counts once, as a row of CAPRI-Net's P that several columns of its
    selection matrix choose (section 3.1).
    """
    found: set[tuple[float, ...]] = set()
    others = 0
    for part in node.parts:
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
