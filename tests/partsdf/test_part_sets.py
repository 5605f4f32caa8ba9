"""Which parts new shapes have: sets of training shapes, as often as these have them, or near one."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from partwright.partsdf.diffusion import levels
from partwright.partsdf.part_sets import Near, drawn_sets

KNOWN = torch.tensor([[1, 1, 0], [1, 1, 0], [1, 1, 0], [1, 0, 1]], dtype=torch.bool)
NONE = torch.zeros(3, dtype=torch.bool)
COUNT = 4000


def drawn(kept: torch.Tensor = NONE, near: Near | None = None, trained: torch.Tensor = KNOWN) -> torch.Tensor:
    """COUNT sets, by even chances."""
    noise = torch.randn(COUNT, 3, generator=torch.Generator().manual_seed(0))
    return drawn_sets(trained, (torch.arange(COUNT) + 0.5) / COUNT, noise, kept, near)


def share(sets: torch.Tensor, of: list[int]) -> float:
    return float((sets == torch.tensor(of, dtype=torch.bool)).all(dim=1).double().mean())


def test_sets_come_as_often_as_training_shapes_have_them() -> None:
    assert share(drawn(), [1, 1, 0]) == 0.75
    assert share(drawn(), [1, 0, 1]) == 0.25


@given(st.floats(0, 1, exclude_max=True, width=32))
def test_each_chance_draws_the_training_shape_in_its_place(chance: float) -> None:
    (found,) = drawn_sets(torch.eye(7, dtype=torch.bool), torch.tensor([chance]), torch.zeros(1, 7),
                          torch.zeros(7, dtype=torch.bool))  # fmt: skip
    assert found.tolist() == [k == int(chance * 7) for k in range(7)]


def test_kept_parts_are_in_every_set_and_draw_those_that_have_them() -> None:
    assert share(drawn(torch.tensor([False, False, True])), [1, 0, 1]) == 1
    both = drawn(torch.tensor([False, True, True]))  # no training shape has both: each has one of them
    assert share(both, [1, 1, 1]) == 1
    assert share(drawn(torch.tensor([True, False, False])), [1, 1, 0]) == 0.75


def test_near_a_set_that_is_new_it_stays_and_far_from_it_the_family_comes() -> None:
    new = torch.tensor([0, 1, 1], dtype=torch.bool)
    assert share(drawn(near=Near(new, 0.1)), [0, 1, 1]) == 1
    some = [share(drawn(near=Near(new, change)), [0, 1, 1]) for change in (0.1, 0.5, 0.7, 1.0)]
    assert some == sorted(some, reverse=True)
    assert 0.2 < some[1] < 1
    assert torch.equal(drawn(near=Near(new, 1.0)), drawn())


def test_a_noisy_set_is_told_as_often_as_bayes_tells_it() -> None:
    """Of two sets that are as frequent and differ by one part, the share that changes over is known."""
    two = torch.tensor([[1, 1, 0], [1, 0, 0]], dtype=torch.bool)
    change = 0.6
    signal, spread = (float(one) for one in levels(torch.tensor(change)))
    at = signal + spread * torch.linspace(-6, 6, 2001, dtype=torch.float64)
    density = torch.exp(-((at - signal) ** 2) / (2 * spread**2))
    own = 2 - change  # the set itself takes part once more, by what is left of it
    other = 1 / (1 + own * torch.exp(2 * signal * at / spread**2))
    expected = float((density * other).sum() / density.sum())
    assert expected > 0.05
    assert share(drawn(near=Near(two[0], change), trained=two), [1, 0, 0]) == pytest.approx(
        expected, abs=0.02
    )
