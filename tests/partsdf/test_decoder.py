"""The decoder against the paper's plain form, its size, and what its options change."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from partwright.errors import SettingError
from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.decoder import Decoder, positional_encoding
from partwright.partsdf.paper import ReferenceDecoder
from partwright.partsdf.transformer import TransformerDecoder

SMALL = DecoderSettings(latent=6, width=16, layers=5)


def filled(decoder: torch.nn.Module) -> torch.nn.Module:
    """No parameter left at a value that hides a mistake."""
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        for parameter in decoder.parameters():
            parameter += 0.2 * torch.randn(parameter.shape, generator=generator, dtype=parameter.dtype)
    return decoder


def inputs(parts: int, latent: int, dtype: torch.dtype = torch.float64) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(2)
    shape = (3, parts, latent), (3, parts, 7, 3)
    z, x = (torch.randn(s, generator=generator, dtype=dtype, requires_grad=True) for s in shape)
    return z, x


@pytest.mark.parametrize("parts", [1, 4])
def test_values_and_gradients_are_those_of_the_plain_form(parts: int) -> None:
    decoder = filled(Decoder(parts, SMALL).double())
    plain = ReferenceDecoder(parts, SMALL).double().load(decoder)
    z, x = inputs(parts, SMALL.latent)
    fast, slow = decoder(z, x), plain(z, x)
    torch.testing.assert_close(fast, slow, rtol=1e-12, atol=1e-12)
    weight = torch.linspace(-1, 2, fast.numel(), dtype=torch.float64).view(fast.shape)
    mine = torch.autograd.grad((weight * fast).sum(), [z, x, *decoder.parameters()])
    theirs = torch.autograd.grad((weight * slow).sum(), [z, x, *plain.parameters()])
    torch.testing.assert_close(mine[0], theirs[0])
    torch.testing.assert_close(mine[1], theirs[1])
    assert sum(g.abs().sum() for g in mine) == pytest.approx(float(sum(g.abs().sum() for g in theirs)), 1e-9)


def test_gradients_agree_with_finite_differences() -> None:
    decoder = filled(Decoder(3, SMALL).double())
    z, x = inputs(3, SMALL.latent)
    assert torch.autograd.gradcheck(decoder, (z, x[:, :, :3].detach().requires_grad_()))
    first = decoder.single[1].weight.length

    def of_weight(length: torch.Tensor) -> torch.Tensor:
        return torch.func.functional_call(decoder, {"single.1.weight.length": length}, (z, x))

    assert torch.autograd.gradcheck(of_weight, (first.detach().clone().requires_grad_(),))


def test_what_is_frozen_or_given_gets_no_gradient_and_the_rest_keeps_its_own() -> None:
    """Reconstruction wants gradients of latents and points, with weights that stay."""
    decoder = filled(Decoder(3, SMALL).double())
    z, x = inputs(3, SMALL.latent)
    weights = list(decoder.parameters())
    wanted = torch.autograd.grad(decoder(z, x).square().sum(), [z, x, *weights])
    decoder.requires_grad_(False)
    found = torch.autograd.grad(decoder(z, x).square().sum(), [z, x])
    torch.testing.assert_close(found, wanted[:2], rtol=0, atol=0)
    decoder.requires_grad_(True)
    found = torch.autograd.grad(decoder(z.detach(), x.detach()).square().sum(), weights)
    torch.testing.assert_close(found, wanted[2:], rtol=0, atol=0)


def test_gradients_under_autocast_are_those_without() -> None:
    """Callers may run backward within the autocast block; the last layer is in full precision."""
    decoder = Decoder(3, SMALL)
    z, x = inputs(3, SMALL.latent, torch.float32)
    with torch.autocast("cpu", torch.bfloat16):
        value = decoder(z, x).square().sum()
        within = torch.autograd.grad(value, [z, x], retain_graph=True)
    torch.testing.assert_close(within, torch.autograd.grad(value, [z, x]), rtol=0.05, atol=1e-3)


def test_only_one_tensor_a_layer_is_kept_for_backward() -> None:
    settings = replace(SMALL, layers=9)
    decoder, (z, x) = Decoder(3, settings), inputs(3, settings.latent, torch.float32)
    kept: dict[int, int] = {}

    def keep(tensor: torch.Tensor) -> torch.Tensor:
        kept[tensor.untyped_storage().data_ptr()] = tensor.untyped_storage().nbytes()
        return tensor

    with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
        decoder(z, x.repeat(1, 1, 1000, 1))
    layer = 4 * 3 * 3 * 7000 * settings.width
    assert 8 * layer <= sum(kept.values()) < 9 * layer


def test_size_is_the_papers() -> None:
    """2.52 M parameters at four parts; a cross-part layer adds P^2 + P."""
    whole = sum(p.numel() for p in Decoder(4, DecoderSettings()).parameters())
    without = sum(p.numel() for p in Decoder(4, DecoderSettings(cross_part=False)).parameters())
    assert whole == 2_517_903
    assert whole - without == 7 * (4 * 4 + 4)


def test_parts_hear_of_one_another_only_through_cross_part_layers() -> None:
    z, x = inputs(3, SMALL.latent)
    moved = z.detach().clone()
    moved[:, 0] += 1
    for cross in (True, False):
        decoder = filled(Decoder(3, replace(SMALL, cross_part=cross)).double())
        change = (decoder(moved, x) - decoder(z, x)).detach().abs().amax(dim=(0, 2))
        assert change[0] > 1e-3
        assert bool((change[1:] > 1e-6).all()) is cross
        if not cross:
            assert float(change[1:].detach().max()) == 0.0


def test_without_modulation_the_latent_enters_once() -> None:
    decoder = Decoder(2, replace(SMALL, modulation=False))
    assert [layer.modulation is not None for layer in decoder.single] == [True, False, False, False, False]


def test_waves_are_sines_and_cosines_in_octaves_and_the_decoder_takes_them() -> None:
    settings = replace(SMALL, octaves=3)
    decoder = filled(Decoder(2, settings).double())
    z, x = inputs(2, SMALL.latent)
    waves = positional_encoding(x, 3)
    assert waves.shape == (3, 2, 7, 3 + 6 * 3)
    torch.testing.assert_close(waves[..., :3], x)
    for axis, octave in ((0, 0), (1, 2), (2, 1)):
        phase = torch.pi / 2 * 2**octave * x[..., axis]
        torch.testing.assert_close(waves[..., 3 + 3 * axis + octave], phase.sin())
        torch.testing.assert_close(waves[..., 3 + 9 + 3 * axis + octave], phase.cos())
    assert decoder(z, x).shape == (3, 2, 7)
    assert torch.autograd.gradcheck(decoder, (z, x[:, :, :2].detach().requires_grad_()))
    with pytest.raises(SettingError, match=r"decoder.octaves is 3.*mlp"):
        replace(settings, architecture="transformer", heads=2)


def test_transformer_is_a_decoder_of_the_same_form() -> None:
    settings = replace(SMALL, architecture="transformer", heads=2)
    decoder = filled(TransformerDecoder(3, settings).double())
    z, x = inputs(3, SMALL.latent)
    assert decoder(z, x).shape == (3, 3, 7)
    assert torch.autograd.gradcheck(decoder, (z[:1, :, :], x[:1, :, :2]), atol=1e-4)
    swapped = decoder(z, torch.flip(x, (2,)))
    torch.testing.assert_close(swapped, torch.flip(decoder(z, x), (2,)))  # points are independent


def test_half_precision_rounds_no_coordinates() -> None:
    decoder = Decoder(2, replace(SMALL, width=64)).float()
    z, x = inputs(2, SMALL.latent, torch.float32)
    with torch.autocast("cpu", torch.bfloat16):
        half = decoder(z, x)
    assert half.dtype == torch.float32
    torch.testing.assert_close(half, decoder(z, x), atol=0.02, rtol=0.05)
