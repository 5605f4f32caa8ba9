"""Chains of corners: the kernel against the same in readable form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from partwright.approximation.sketches.chains import circle_through, open_line

Floats = NDArray[np.float64]


def off_chord(a: Floats, b: Floats, points: Floats) -> Floats:
    way = b - a
    length = float(way @ way)
    share = np.clip((points - a) @ way / length, 0, 1) if length > 1e-18 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - a - share[:, None] * way, axis=1))


def reference(points: Floats, tolerance: float) -> list[int]:
    kept, stack = {0, len(points) - 1}, [(0, len(points) - 1)]
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        off = off_chord(points[a], points[b], points[a + 1 : b])
        worst = a + 1 + int(off.argmax())
        if off.max() > tolerance:
            kept.add(worst)
            stack += [(a, worst), (worst, b)]
    return sorted(kept)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 80), st.booleans())
def test_the_kernel_keeps_the_corners_that_lines_need(seed: int, count: int, closed: bool) -> None:
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 2))
    if closed:
        points[-1] = points[0]
    for tolerance in (0.0, 0.1, 0.7, 4.0):
        assert open_line(points, tolerance).tolist() == reference(points, tolerance)


def test_all_corners_within_the_tolerance_of_their_line_go() -> None:
    points = np.array([(0, 0), (1, 0.009), (2, -0.009), (3, 0), (3, 2), (3.005, 3), (3, 4)], float)
    assert open_line(points, 0.01).tolist() == [0, 3, 6]
    assert open_line(points, 0.008).tolist() == [0, 1, 2, 3, 6]
    assert open_line(points[:1], 0.1).tolist() == [0]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 60))
def test_the_circle_through_points_is_the_nearest_one(seed: int, count: int) -> None:
    """Of all circles x^2 + y^2 = 2 a x + 2 b y + c the one of least squares."""
    points = np.random.default_rng(seed).normal((3, -2), size=(count, 2))
    centre, radius, off = circle_through(points)
    equations = np.column_stack([2 * points, np.ones(count)])
    a, b, c = np.linalg.lstsq(equations, (points**2).sum(axis=1), rcond=None)[0]
    np.testing.assert_allclose(centre, (a, b), rtol=1e-6, atol=1e-6)
    assert radius == pytest.approx(math.sqrt(c + a * a + b * b), rel=1e-6)
    assert off == pytest.approx(np.abs(np.linalg.norm(points - centre, axis=1) - radius).max(), rel=1e-9)


def test_an_arc_is_met_exactly_and_a_line_is_no_circle() -> None:
    angle = np.linspace(0.3, 1.1, 7)
    arc = np.column_stack([2 + 0.5 * np.cos(angle), 0.5 * np.sin(angle) - 1])
    centre, radius, off = circle_through(arc)
    np.testing.assert_allclose([*centre, radius], (2, -1, 0.5), atol=1e-9)
    assert off < 1e-12
    assert circle_through([(0, 0), (1, 1), (2, 2), (5, 5)])[1:] == (math.inf, math.inf)
