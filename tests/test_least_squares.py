"""Damped least squares against scipy's, and where steps are refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.optimize

from partwright.least_squares import Damping, Minimum, damped_step, minimise

Residual = Callable[[np.ndarray], np.ndarray]
TIMES = np.linspace(0, 3, 40)


def valley(x: np.ndarray) -> np.ndarray:
    """Rosenbrock's: 0 at (1, 1)."""
    return np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def decay(x: np.ndarray) -> np.ndarray:
    """Of noisy measurements, so that something is left at the least."""
    noise = 0.02 * np.random.default_rng(0).normal(size=len(TIMES))
    return x[0] * np.exp(-x[1] * TIMES) + x[2] - (2 * np.exp(-1.3 * TIMES) + 0.5 + noise)


def run(residual: Residual, start: np.ndarray, damping: Damping, move=np.add, **rest) -> Minimum[np.ndarray]:
    def linearise(x: np.ndarray):
        jacobian = scipy.optimize.approx_fprime(x, residual, 1e-7).reshape(-1, len(x))
        return residual(x) @ residual(x), jacobian.T @ residual(x), jacobian.T @ jacobian

    return minimise(start, linearise, lambda x: float(residual(x) @ residual(x)), move, damping, **rest)


@pytest.mark.parametrize(
    ("residual", "start"), [(valley, [-1.2, 1.0]), (decay, [1.0, 0.3, 0.0])], ids=["valley", "decay"]
)
def test_it_ends_where_scipy_does(residual: Residual, start: list[float]) -> None:
    expected = scipy.optimize.least_squares(residual, start, method="lm", xtol=1e-12, ftol=1e-12)
    found = run(residual, np.array(start), Damping(trials=200))
    np.testing.assert_allclose(found.state, expected.x, atol=1e-5)


def test_a_step_that_raises_the_loss_is_refused_and_damped_until_one_lowers_it() -> None:
    start = np.array([3.0])
    undamped = start + damped_step(np.arctan(start) / 10, np.array([[0.01]]), 0.0, Damping(1))
    assert abs(undamped[0]) > 3  # Gauss-Newton runs away from 3 to -9.5
    tried: list[float] = []

    def move(x: np.ndarray, step: np.ndarray) -> np.ndarray:
        tried.append(float(x[0] + step[0]))
        return x + step

    first = run(np.arctan, start, Damping(trials=9, steps=1), move)
    assert first.steps == 1
    assert len(tried) > 1
    assert all(abs(x) > 3 for x in tried[:-1])
    assert abs(first.state[0]) < 3
    assert first.damping == pytest.approx(1e-2 * 5.0 ** (len(tried) - 1) * 0.3)
    assert abs(run(np.arctan, start, Damping(trials=40)).state[0]) < 1e-6


def test_refusals_in_a_row_end_it_where_it_began() -> None:
    start = np.array([3.0])
    found = run(np.arctan, start, Damping(trials=50, up=1.0, refusals=4))
    assert found.state is start
    assert found.steps == 0
    calls: list[int] = []
    run(valley, np.zeros(2), Damping(trials=50, refusals=3), lambda x, step: calls.append(1))
    assert len(calls) == 3  # there is no state to move to


def test_it_stays_within_bounds_that_moving_keeps() -> None:
    found = run(valley, np.array([-1.2, 1.0]), Damping(300), lambda x, step: np.clip(x + step, -2.0, 0.5))
    np.testing.assert_allclose(found.state, [0.5, 0.25], atol=1e-3)


def test_it_stops_once_settled_and_once_cancelled() -> None:
    start = np.array([1.0, 0.3, 0.0])
    long, short = (run(decay, start, Damping(60, settled=share)) for share in (0.0, 0.5))
    assert 1 <= short.steps < long.steps
    answers = iter([False, False, True])
    cut = run(decay, start, Damping(60), cancelled=lambda: next(answers))
    assert cut.steps <= 2
    assert np.linalg.norm(decay(cut.state)) < np.linalg.norm(decay(start))


def test_the_floor_keeps_what_has_no_influence_in_place() -> None:
    gradient, matrix = np.array([1.0, 1e-9]), np.diag([1.0, 0.0])
    step = damped_step(gradient, matrix, 1.0, Damping(1, floor=1e-3, ridge=1e-12))
    assert step[0] == pytest.approx(-0.5, rel=1e-2)
    assert abs(step[1]) < 1e-5
