"""The compiled networks against PyTorch's in double precision: values and all derivatives."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.local import REACH, LocalDecoder
from partwright.partsdf.poses import PoseTensors, local_points

# Widths that are a whole number of the kernel's tiles, and not.
SETTINGS = DecoderSettings(latent=6, width=32, layers=4, octaves=3, architecture="local", token=16, heads=2)


def drawn(points: int) -> tuple[torch.Tensor, torch.Tensor, PoseTensors]:
    """Latents (2, 4, Z), points (2, N, 3) and poses (2, 4, ...)."""
    generator = torch.Generator().manual_seed(3)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator)

    poses = PoseTensors(0.4 * normal(2, 4, 3), normal(2, 4, 4), 0.1 + 0.1 * normal(2, 4, 3).abs())
    return normal(2, 4, SETTINGS.latent), 0.5 * normal(2, points, 3), poses


def made(settings: DecoderSettings) -> LocalDecoder:
    torch.manual_seed(0)
    decoder = LocalDecoder(4, settings)
    decoder.fit_room(torch.rand(4, 3) + 0.8)
    return decoder


def derivatives(
    decoder: LocalDecoder, kind: torch.dtype, weight: torch.Tensor, points: int
) -> list[torch.Tensor]:
    """Distances, and derivatives of sum(weight * distances) by latents, points, poses and parameters."""
    decoder = decoder.to(kind)
    decoder.zero_grad()
    z, x, poses = drawn(points)
    inputs = [t.to(kind).requires_grad_() for t in (z, x, *poses)]
    placed = PoseTensors(*inputs[2:])
    found = decoder(inputs[0], local_points(inputs[1], placed), placed)
    (found * weight.to(kind)).sum().backward()
    weights = [p.grad.clone() for p in decoder.parameters() if p.grad is not None and p.numel()]
    each = [found.detach(), *(t.grad for t in inputs), *weights]
    return [t.double() for t in each if t is not None]


@pytest.mark.parametrize("width", [32, 20])
@pytest.mark.parametrize("share", [1.0, 0.3])
@pytest.mark.parametrize("learning", [True, False])
def test_values_and_derivatives_are_those_in_double_precision(
    width: int, share: float, learning: bool
) -> None:
    """More points a part than go through at once, some far; `share` of the distances have a weight."""
    decoder, points = made(replace(SETTINGS, width=width)).train(learning), 700
    generator = torch.Generator().manual_seed(1)
    weight = torch.randn(2, 4, points, generator=generator)
    weight *= torch.rand(weight.shape, generator=generator) < share
    found = derivatives(decoder, torch.float32, weight, points)
    expected = derivatives(decoder, torch.float64, weight, points)
    near = expected[0] < REACH
    assert 0.05 < near.double().mean() < 0.9
    torch.testing.assert_close(found[0], expected[0], rtol=0, atol=2e-6)
    for one, other in zip(found[1:], expected[1:], strict=True):
        assert (one - other).abs().max() < 2e-5 * max(1.0, float(other.abs().max()))
    assert len(found) > 6 + 2 * SETTINGS.layers  # of the parameters, too


def test_results_are_the_same_on_any_number_of_threads() -> None:
    decoder, threads = made(SETTINGS), torch.get_num_threads()
    weight = torch.randn(2, 4, 300, generator=torch.Generator().manual_seed(1))
    try:
        results = []
        for count in (1, 3):
            torch.set_num_threads(count)
            results.append(derivatives(decoder, torch.float32, weight, 300)[0])
    finally:
        torch.set_num_threads(threads)
    assert torch.equal(*results)


def test_a_part_that_says_less_than_its_room_everywhere_still_learns_where_more_is_wanted() -> None:
    decoder = made(SETTINGS)
    with torch.no_grad():
        decoder.modulation.bias[-1] = -100.0  # the last shift: deep inside, wherever it is asked
    points = decoder.room[None, :, None] * (2 * torch.rand(2, 4, 50, 3) - 1)
    z, _, poses = drawn(1)

    def heard(wanted: float) -> bool:
        decoder.zero_grad()
        (-wanted * decoder(z, points, poses)).sum().backward()
        return bool((decoder.weights[-1].grad.abs() > 0).any())

    assert (decoder(z, points, poses) <= 0).all()
    assert heard(1.0)
    assert not heard(-1.0)  # no part leaves its room, so less is of no use
    decoder.eval()
    assert not heard(1.0)  # the true derivative


def test_parts_that_are_asked_nowhere_have_no_derivatives_by_their_networks() -> None:
    decoder = made(SETTINGS)
    z, _, poses = drawn(1)
    z.requires_grad_()
    away = torch.full((2, 4, 9, 3), 50.0, requires_grad=True)
    found = decoder(z, away, poses)
    room = ((away.abs() - decoder.room[:, None]) * poses.scale[:, :, None]).amax(-1)
    torch.testing.assert_close(found, room)
    found.sum().backward()
    assert z.grad is not None
    assert not z.grad.any()
    assert away.grad is not None
    assert (away.grad.abs().sum(dim=-1) > 0).all()
