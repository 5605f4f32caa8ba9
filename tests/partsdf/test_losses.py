"""The losses on cases that can be worked out by hand, and against finite differences."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch

from partwright.partsdf.config import DecoderSettings, LossSettings
from partwright.partsdf.losses import aggregate, clamped_error, intersection, latent_penalty, terms

LOSSES, MIN = LossSettings(), DecoderSettings()


def tensor(*values: float) -> torch.Tensor:
    return torch.tensor([values], dtype=torch.float64)


def test_errors_are_clamped_where_the_target_is() -> None:
    sdf = tensor(0.3, 0.3, -0.3, -0.3, 0.05)
    predicted = tensor(0.2, 0.0, -5.0, 0.0, 0.2)
    error = clamped_error(predicted, sdf, LossSettings(hard=0.0))
    torch.testing.assert_close(error, tensor(0.0, 0.1, 0.0, 0.1, 0.15))


def test_errors_towards_the_wrong_side_weigh_more() -> None:
    error = clamped_error(tensor(0.0, 0.04, 0.0, -0.04), tensor(0.02, 0.02, -0.02, -0.02), LOSSES)
    torch.testing.assert_close(error, tensor(0.03, 0.01, 0.03, 0.01))


def test_a_wrong_prediction_beyond_the_clamp_keeps_its_gradient() -> None:
    predicted = tensor(-4.0).requires_grad_()
    clamped_error(predicted, tensor(0.5), LOSSES).sum().backward()
    assert predicted.grad is not None
    assert float(predicted.grad) == -1.5


def test_intersection_is_eq_9() -> None:
    distances = torch.tensor([[[-0.02, -0.1, 0.3], [-0.04, 0.1, 0.3], [0.1, 0.2, 0.1]]], dtype=torch.float64)
    weights = [math.exp(-1.0), math.exp(-2.0)]
    expected = (weights[0] * 0.02 + weights[1] * 0.04) / sum(weights)  # only the first point counts
    assert float(intersection(distances, LOSSES)) == pytest.approx(expected)
    assert float(intersection(distances.abs(), LOSSES)) == 0.0


def test_intersection_over_all_points_leaves_a_few_no_more_than_their_share() -> None:
    distances = torch.tensor([[[-0.02, -0.1, 0.3], [-0.04, 0.1, 0.3], [0.1, 0.2, 0.1]]], dtype=torch.float64)
    over_all = intersection(distances, replace(LOSSES, inter_over="all"))
    assert float(over_all) == pytest.approx(float(intersection(distances, LOSSES)) / 3)


def test_intersection_pushes_parts_out_and_the_shallow_one_more() -> None:
    distances = torch.tensor([[[-0.02], [-0.06]]], dtype=torch.float64, requires_grad=True)
    intersection(distances, LOSSES).backward()
    assert distances.grad is not None
    shallow, deep = distances.grad.flatten().tolist()
    assert shallow < deep < 0  # descent raises both, the shallow one faster


def test_softmin_lies_just_below_the_minimum() -> None:
    distances = torch.tensor([[[0.3, 0.0], [0.1, 0.0]]], dtype=torch.float64)
    soft = aggregate(distances, DecoderSettings(aggregation="softmin", softness=0.01))
    torch.testing.assert_close(soft, tensor(0.1, -0.01 * math.log(2)), atol=1e-9, rtol=0)


def test_all_terms_agree_with_finite_differences() -> None:
    generator = torch.Generator().manual_seed(0)
    distances = 0.1 * torch.randn(2, 3, 20, generator=generator, dtype=torch.float64)
    sdf = 0.1 * torch.randn(2, 20, generator=generator, dtype=torch.float64)
    part = torch.randint(0, 3, (2, 20), generator=generator)

    def whole_and_part(d: torch.Tensor) -> torch.Tensor:
        found = terms(d, sdf, part, LOSSES, MIN)
        return torch.stack([found.whole, found.part])

    assert torch.autograd.gradcheck(whole_and_part, (distances.requires_grad_(),))


def test_the_nearest_part_alone_is_held_to_the_shape() -> None:
    """A part is supervised where it is nearest (eq. 5), so what it says elsewhere costs nothing."""
    sdf, part = tensor(0.05, 0.05), torch.tensor([[0, 1]])
    distances = torch.tensor([[[0.05, 0.09], [0.08, 0.05]]], dtype=torch.float64)
    found = terms(distances, sdf, part, LOSSES, MIN)
    assert [float(t) for t in found] == [0.0, 0.0, 0.0]


def test_latent_term_ramps_in() -> None:
    z = torch.ones(2, 3, 4)
    assert float(latent_penalty(z, LOSSES, 0)) == 0.0
    assert float(latent_penalty(z, LOSSES, 50)) == pytest.approx(24 * 0.5e-4)
    assert float(latent_penalty(z, LOSSES, 500)) == pytest.approx(24 * 1e-4)
