"""A tree without what does not matter: its removal changes next to no point's side (section 3.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import Convex, CsgTree

MAX_CHANGED_SHARE = 1 / 50_000  # of the points may change side for each removal, as in the authors' program


def pruned(tree: CsgTree, points: NDArray[np.floating]) -> CsgTree:
    """The tree after greedy removals, convexes first; points (N, 3) of the unit frame, best near the surface.

    Only for trees of at most two layers (eq. 5).
    """
    outside = rows.values(tree.rows, points) > 0
    layers = [list(layer) for layer in tree.layers] + [[] for _ in range(2 - len(tree.layers))]
    most = int(MAX_CHANGED_SHARE * len(points))
    before = None
    while layers != before:
        before = [list(layer) for layer in layers]
        for side in range(2):
            _drop_convexes(layers, side, outside, most)
            for i in range(len(layers[side])):
                layers[side][i] = _drop_primitives(layers, side, i, outside, most)
    kept = tuple(tuple(layer) for layer in layers)
    return CsgTree(tree.rows, tree.complement, kept[: 2 if kept[1] else 1])


def _covers(layer: list[Convex], outside: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N,) how many convexes of a layer hold each point."""
    count = np.zeros(len(outside), dtype=np.int64)
    for convex in layer:
        count += ~outside[:, list(convex)].any(axis=1)
    return count


def _matters(layers: list[list[Convex]], side: int, outside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) where the other side leaves it to this one whether a point is inside."""
    other = _covers(layers[1 - side], outside) > 0
    return ~other if side == 0 else other


def _drop_convexes(layers: list[list[Convex]], side: int, outside: NDArray[np.bool_], most: int) -> None:
    matters = _matters(layers, side, outside)
    for convex in sorted(layers[side], key=lambda c: int((~outside[:, list(c)].any(axis=1)).sum())):
        alone = ~outside[:, list(convex)].any(axis=1) & (_covers(layers[side], outside) == 1)
        if (alone & matters).sum() <= most:
            layers[side].remove(convex)


def _drop_primitives(
    layers: list[list[Convex]], side: int, index: int, outside: NDArray[np.bool_], most: int
) -> Convex:
    """The convex without those of its primitives that keep nothing out."""
    rest = [c for i, c in enumerate(layers[side]) if i != index]
    matters = _matters(layers, side, outside) & (_covers(rest, outside) == 0)
    rows_of = outside[matters]
    chosen = list(layers[side][index])
    count = rows_of[:, chosen].sum(axis=1)
    while len(chosen) > 1:
        opened = [int(((count == 1) & rows_of[:, k]).sum()) for k in chosen]
        least = int(np.argmin(opened))
        if opened[least] > most:
            break
        count -= rows_of[:, chosen.pop(least)]
    return tuple(chosen)
