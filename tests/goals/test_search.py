"""The search by itself, on numbers that need no surface."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from partwright.goals.search import search

BEND = 20.0


class Two:
    values, units = np.zeros(2), np.ones(2)

    def __len__(self) -> int:
        return 2


class Valley:
    """-x is made less, where y may not exceed -20 x^2: along the slope of that, which is level at the start,
    every step breaks it."""

    def __init__(self, steps: int) -> None:
        self.options = SimpleNamespace(steps=steps)
        self.parameters = Two()
        self.free = np.ones(2, bool)
        self.lower, self.upper = -np.ones(2), np.ones(2)
        self.region = SimpleNamespace(outside=lambda _: 0.0)

    def at(self, change: np.ndarray) -> Any:
        x, y = change
        broken = np.array([y + BEND * x * x])
        return SimpleNamespace(change=change, value=-float(x), broken=broken, numbers={}, assembly=None)

    def slopes(self, point: Any) -> tuple[np.ndarray, np.ndarray]:
        return np.array([-1.0, 0.0]), np.array([[2 * BEND * point.change[0], 1.0]])


def test_a_constraint_that_bends_is_met_by_a_second_try_of_the_same_length() -> None:
    valley: Any = Valley(2)
    found = search(valley)
    first, second = found.steps[1:]
    assert not first.accepted
    assert first.broken == pytest.approx(BEND * first.radius**2, rel=0.01)
    assert second.accepted
    assert second.radius == first.radius
    assert found.points[-1].change[0] == pytest.approx(first.radius, rel=0.01)
    assert second.broken <= 1e-6


def test_a_step_that_leaves_the_trained_region_ends_it_before() -> None:
    valley: Any = Valley(30)
    valley.region = SimpleNamespace(outside=lambda values: values[0] / 0.08)
    found = search(valley)
    assert found.ending == "left_trained_region"
    assert "trained on" in found.reason
    assert 0.04 < found.points[-1].change[0] <= 0.08


def test_a_long_way_along_it_is_gone() -> None:
    valley: Any = Valley(30)
    found = search(valley)
    x, y = found.points[-1].change
    assert x > 0.1
    assert y <= -BEND * x * x + 1e-3
