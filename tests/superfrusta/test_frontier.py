"""What attempts have reached with how many parts."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.superfrusta.frontier import Frontier


def test_attempts_are_compared_at_the_same_number_of_parts() -> None:
    frontier = Frontier()
    for parts, objective in ((7, 0.7), (13, 0.82), (19, 0.8)):
        frontier.add(parts, objective)
    assert frontier.at(7) == pytest.approx(0.7)
    assert frontier.at(10) == pytest.approx(0.76)
    assert frontier.at(40) == pytest.approx(0.82)  # with more parts it reached no more
    assert frontier.lead(10, 0.8) == pytest.approx(0.04)
    assert frontier.lead(6, 0.6) == pytest.approx(-0.1)


def test_it_is_too_early_to_tell_with_few_parts_or_nothing_to_compare() -> None:
    frontier = Frontier()
    assert frontier.lead(20, 0.1) == 0.0
    frontier.add(7, 0.9)
    assert frontier.lead(5, 0.1) == 0.0
    assert frontier.lead(5, 0.95) == pytest.approx(0.05)  # but ahead with fewer is ahead


def test_it_never_falls_with_more_parts() -> None:
    rng = np.random.default_rng(0)
    frontier = Frontier()
    for _ in range(30):
        frontier.add(int(rng.integers(1, 40)), float(rng.uniform()))
    assert (np.diff([frontier.at(parts) for parts in range(50)]) >= 0).all()
