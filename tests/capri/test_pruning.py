"""Pruning takes out what is redundant and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import CsgTree
from partwright.capri.pruning import MAX_CHANGED_SHARE, pruned

POINTS = np.random.default_rng(0).uniform(-1, 1, (60_000, 3))
AXES = np.concatenate([np.eye(3), -np.eye(3)])
SLABS = [rows.plane(axis, 0.6) for axis in AXES]  # 0-5: a cube
HOLE = rows.cylinder((0, 0, 0), (0, 0, 1), 0.3)  # 6
WIDE = [rows.plane(axis, 0.9) for axis in AXES]  # 7-12: a cube around it
SMALL = rows.sphere((0, 0.45, 0), 0.1)  # 13: within the cube, beside the hole
FAR = rows.sphere((0.8, 0.8, 0.8), 0.1)  # 14: outside
TABLE = np.stack([*SLABS, HOLE, *WIDE, SMALL, FAR])
PLAIN = CsgTree(TABLE, np.zeros(15, bool), (((0, 1, 2, 3, 4, 5),), ((6,),)))


def test_a_tree_without_excess_stays() -> None:
    assert pruned(PLAIN, POINTS).layers == PLAIN.layers


def test_excess_goes() -> None:
    """Wider planes in a convex, a convex within another, one subtracted where nothing is."""
    layers = (((0, 1, 2, 3, 4, 5, 7, 8), (7, 13)), ((6, 12), (14,)))
    slim = pruned(CsgTree(TABLE, PLAIN.complement, layers), POINTS)
    assert {frozenset(c) for c in slim.layers[0]} == {frozenset(range(6))}
    assert slim.layers[1] == ((6,),)  # plane 12 cuts the hole off where the cube has ended
    assert np.array_equal(slim.occupancy(POINTS), PLAIN.occupancy(POINTS))


@pytest.mark.parametrize("seed", range(5))
def test_each_removal_changes_next_to_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    layers = tuple(
        tuple(tuple(sorted(rng.choice(15, rng.integers(1, 8), replace=False).tolist())) for _ in range(4))
        for _ in range(2)
    )
    whole = CsgTree(TABLE, PLAIN.complement, layers)
    slim = pruned(whole, POINTS)
    removals = whole.primitives - slim.primitives
    changed = int((whole.occupancy(POINTS) != slim.occupancy(POINTS)).sum())
    assert changed <= removals * int(MAX_CHANGED_SHARE * len(POINTS))
    assert slim.primitives < whole.primitives
