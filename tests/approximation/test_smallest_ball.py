"""The smallest ball around points: known ones, and the laws of the smallest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from partwright.approximation.smallest_ball import smallest_ball


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
def test_known_ones(size: float) -> None:
    corners = size * np.array(list(np.ndindex(2, 2, 2)), float)
    centre, radius = smallest_ball(corners)
    assert centre == pytest.approx(np.full(3, size / 2))
    assert radius == pytest.approx(size * 3**0.5 / 2)
    wide = size * np.array([(-1.0, 0), (1, 0), (0, 0.2)])  # of a blunt triangle the longest side's
    assert smallest_ball(wide)[1] == pytest.approx(size)
    sharp = size * np.array([(0.0, 0), (1, 0), (0.5, 3**0.5 / 2)])
    assert smallest_ball(sharp)[1] == pytest.approx(size / 3**0.5)
    assert smallest_ball(size * np.ones((5, 3)))[1] == pytest.approx(0, abs=1e-12 * size)


@pytest.mark.parametrize("count", [64, 1000])
@pytest.mark.parametrize("dimensions", [2, 3])
def test_points_on_a_sphere_and_in_it(dimensions: int, count: int) -> None:
    """Many that determine it as well as one another."""
    random = np.random.default_rng(count)
    points = random.normal(size=(count, dimensions))
    points = 2 * points / np.linalg.norm(points, axis=1, keepdims=True) + 7
    _, radius = smallest_ball(np.concatenate([points, 0.3 * points + 0.7 * 7]))
    assert radius == pytest.approx(2.0, rel=1e-3 if count == 1000 else 0.05)
    assert radius <= 2 * (1 + 1e-12)


@settings(max_examples=100, deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)), elements=st.floats(-10, 10, width=32)))
def test_it_contains_all_and_none_is_smaller(points: np.ndarray) -> None:
    """The smallest is where the centre lies among the points that are farthest from it."""
    centre, radius = smallest_ball(points)
    away = np.linalg.norm(points - centre, axis=1)
    assert away.max() <= radius
    far = points[away >= radius * (1 - 1e-6) - 1e-9] - centre
    for way in np.random.default_rng(0).normal(size=(50, 3)):  # no half space has none of them
        assert (far @ way).max() >= -1e-4 * max(radius, 1e-3) * np.linalg.norm(way)
