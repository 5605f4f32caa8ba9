"""The objective on samples small enough to count by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.fields import kernel
from partwright.fields.columns import UNSIGNED
from partwright.shapes.grid import DistanceGrid
from partwright.superfrusta.backend import backend
from partwright.superfrusta.objective import occupancy_score, removal_scores, score, volume_iou
from partwright.superfrusta.samples import FitSamples
from tests.superfrusta.rows import ball, points_in_box, random_rows

GRID = DistanceGrid(np.zeros(3), 0.1, np.ones((2, 2, 2), np.float32))


def samples(points: np.ndarray, inside: np.ndarray, weight: np.ndarray, near: int) -> FitSamples:
    distance = np.where(inside, -0.1, 0.1)
    return FitSamples(
        points.astype(np.float32),
        distance.astype(np.float32),
        weight.astype(np.float32),
        near,
        GRID,
        seed=0,
        threads=1,
        device="cpu",
        kernel=backend("cpu"),
        measure=lambda points: np.ones(len(points), np.float32),
        away=lambda points: np.ones(len(points), np.float32),
        density=1.0,
        probes=np.empty((0, 3), np.float32),
        surface=np.empty((0, 3), np.float32),
    )


def by_hand() -> FitSamples:
    """On a line: near samples at x = 0, 1, 2, 3 of weight 1, 2, 1, 1.5, volume samples at x = 0 ... 4."""
    x = np.array([0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 4.0])
    inside = np.array([1, 1, 0, 0, 1, 1, 1, 0, 0], bool)
    weight = np.array([1, 2, 1, 1.5, 1, 1, 1, 1, 1])
    return samples(np.stack([x, 0 * x, 0 * x], axis=1), inside, weight, near=4)


def test_the_score_of_occupancies_by_hand() -> None:
    made = by_hand()
    assert occupancy_score(made, made.inside) == 1.0
    assert occupancy_score(made, ~made.inside) == 0.0
    assert occupancy_score(made, np.zeros(9, bool)) == 0.0
    everything = occupancy_score(made, np.ones(9, bool))
    assert everything == pytest.approx(0.5 * (3 / 5.5 + 3 / 5))
    # Occupied at x = 1, 2: near 2 of 1 + 2 + 1, volume 2 of 3.
    occupied = np.isin(made.points[:, 0], (1.0, 2.0))
    assert occupancy_score(made, occupied) == pytest.approx(0.5 * (2 / 4 + 2 / 3))
    stacked = occupancy_score(made, np.stack([occupied, made.inside, np.ones(9, bool)]))
    np.testing.assert_allclose(stacked, [0.5 * (2 / 4 + 2 / 3), 1.0, everything])


def test_the_score_of_balls_by_hand() -> None:
    made = by_hand()
    rows = np.array([ball(0.4, (1.0, 0, 0)), ball(0.4, (2.0, 0, 0)), ball(0.4, (3.0, 0, 0))])
    assert score(made, rows[:2]) == pytest.approx(0.5 * (2 / 4 + 2 / 3))
    assert volume_iou(made, rows[:2]) == pytest.approx(2 / 3)
    without, whole = removal_scores(made, rows)
    assert whole == pytest.approx(0.5 * (2 / 5.5 + 2 / 4))
    np.testing.assert_allclose(
        without, [0.5 * (0 / 5.5 + 1 / 4), 0.5 * (2 / 4.5 + 1 / 4), 0.5 * (2 / 4 + 2 / 3)]
    )


def test_nothing_scores_nothing() -> None:
    made, none = by_hand(), np.empty((0, UNSIGNED), np.float32)
    assert score(made, none) == 0.0
    assert volume_iou(made, none) == 0.0


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), parts=st.integers(1, 6))
def test_removal_scores_equal_the_scores_of_what_is_left(seed: int, parts: int) -> None:
    rows, points = random_rows(parts, seed), points_in_box(1200, seed)
    inside = kernel.evaluate(random_rows(3, seed + 1), points) < 0
    weight = np.random.default_rng(seed).uniform(0.5, 2, 1200)
    weight[500:] = 1
    made = samples(points, inside, weight, near=500)
    without, whole = removal_scores(made, rows)
    assert whole == pytest.approx(score(made, rows), abs=1e-5)
    left = [score(made, np.delete(rows, i, axis=0)) for i in range(parts)]
    np.testing.assert_allclose(without, left, atol=1e-5)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_the_score_is_an_iou(seed: int) -> None:
    """Between 0 and 1, 1 only for equality, and it rises with every sample put right."""
    generator = np.random.default_rng(seed)
    inside, occupied = generator.random((2, 300)) < 0.5
    made = samples(points_in_box(300), inside, generator.uniform(1, 2, 300), near=150)
    before = float(occupancy_score(made, occupied))
    assert 0 <= before < 1
    wrong = int(np.flatnonzero(occupied != inside)[0])
    occupied[wrong] = inside[wrong]
    assert occupancy_score(made, occupied) > before
    assert occupancy_score(made, inside) == 1
