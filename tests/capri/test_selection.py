"""The search's sums against plain recounting, and its result against every other tree of a small problem."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.capri import selection
from partwright.capri.selection import Layers, Problem


def problem(seed: int, samples: int = 300, quadrics: int = 8, price: float = 2.0) -> Problem:
    """Half-planes on samples of the unit square, the shape a box less a corner."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 1, (samples, 2))
    normal = rng.normal(size=(quadrics, 2))
    outside = (points @ normal.T > rng.uniform(-0.2, 0.8, quadrics)).astype(np.float32)
    inside = ~outside[:, :3].any(axis=1) & outside[:, 3:5].any(axis=1)
    weight = rng.integers(1, 9, samples).astype(np.float32)
    return Problem(outside, inside, weight, np.full(quadrics, price), 3 * price, np.random.default_rng(0))


layers = st.lists(
    st.lists(st.sets(st.integers(0, 7), min_size=1, max_size=4).map(lambda s: tuple(sorted(s))), max_size=3),
    min_size=2,
    max_size=3,
)


@settings(max_examples=60)
@given(st.integers(0, 20), layers, st.sets(st.integers(0, 7), min_size=1, max_size=4), st.integers(0, 1))
def test_worth_is_the_fall_of_the_error(seed: int, given: Layers, new: set[int], at: int) -> None:
    p = problem(seed)
    convex = tuple(sorted(new))
    fall = float(p.error_reduction(given, at)[p.covered(convex)].sum())
    with_it = [[*layer, convex] if k == at else layer for k, layer in enumerate(given)]
    assert p.error(given) - p.error(with_it) == fall


@settings(max_examples=60)
@given(st.integers(0, 20), st.sets(st.integers(0, 7), min_size=1, max_size=4))
def test_improving_never_loses_and_ends_where_no_single_move_gains(seed: int, start: set[int]) -> None:
    p = problem(seed)
    error_reduction = p.error_reduction([[], []], 0)

    def value(convex: tuple[int, ...]) -> float:
        return float(error_reduction[p.covered(convex)].sum()) - p.length(convex)

    convex, reached = selection.improve(p, p.outside, error_reduction, tuple(start))
    assert reached == value(convex) >= value(tuple(start))
    rest = set(range(8)) - set(convex)
    moves = [set(convex) | {k} for k in rest] + [set(convex) - {k} for k in convex]
    moves += [set(convex) - {i} | {k} for i in convex for k in rest]
    assert all(value(tuple(sorted(move))) <= reached + 0.01 for move in moves)


def test_the_best_convex_is_the_best_of_all() -> None:
    hits = 0
    for seed in range(8):
        p = problem(seed, quadrics=6)
        error_reduction = p.error_reduction([[], []], 0)
        every = [c for size in range(1, 7) for c in combinations(range(6), size)]
        best = max(0.0, *(float(error_reduction[p.covered(c)].sum()) - p.length(c) for c in every))
        _, value = selection.best_convex(p, error_reduction)
        assert value <= best + 1e-6
        hits += value > best - 1e-6
    assert hits >= 7


def test_polish_and_ruin_never_cost_more() -> None:
    for seed in range(6):
        p = problem(seed)
        first = selection.fill(p, [[], []], 1.0, 10)
        polished = selection.polish(p, first, 10)
        assert p.cost(polished) <= p.cost(first)
        assert p.cost(selection.ruin_and_recreate(p, polished, 10)) <= p.cost(polished)


def test_a_shape_of_two_layers_is_found_exactly() -> None:
    """A square with a round hole and a bar across the hole: outside in all but what the truth says."""
    x, y = np.random.default_rng(0).uniform(-1, 1, (2, 4000))
    planes = np.stack([x - 0.8, -x - 0.8, y - 0.8, -y - 0.8, x**2 + y**2 - 0.25, x - 0.1, -x - 0.1], axis=1)
    outside = (planes > 0).astype(np.float32)
    box = ~outside[:, :4].any(axis=1)
    inside = box & (outside[:, 4] > 0)
    ones = np.ones(4000, np.float32)
    p = Problem(outside, inside, ones, np.full(7, 5.0), 10.0, np.random.default_rng(0))
    solved = selection.polish(p, selection.fill(p, [[], []], 0.3, 10), 10)
    assert solved == [[(0, 1, 2, 3)], [(4,)]]
    assert p.error(solved) == 0
