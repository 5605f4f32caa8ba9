"""A step taken a few shapes at a time has the gradient of the whole batch."""

from __future__ import annotations

import signal
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.errors import SettingError
from partwright.partsdf.autodecoder import AutoDecoder
from partwright.partsdf.config import Config, DecoderSettings, LossSettings, TrainingSettings
from partwright.partsdf.gradient_accumulation import backward
from partwright.partsdf.losses import intersection, latent_penalty, terms
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.training import MODEL, EpochReport, train
from tests.partsdf.lamps import small_config

SHAPES, PARTS, POINTS = 5, 3, 40
DECODER = DecoderSettings(latent=6, width=16, layers=5)


def config(at_once: int, inter_over: str) -> Config:
    training = TrainingSettings(batch=SHAPES, at_once=at_once)
    losses = LossSettings(inter_over=inter_over)
    return Config("family", "model", decoder=DECODER, losses=losses, training=training)


def batch() -> tuple:
    """Shapes in another order than their latents."""
    generator = torch.Generator().manual_seed(3)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    poses = PoseTensors(normal(SHAPES, PARTS, 3), normal(SHAPES, PARTS, 4), 1 + normal(SHAPES, PARTS, 3) ** 2)
    part = torch.randint(PARTS, (SHAPES, POINTS), generator=generator)
    drawn = (normal(SHAPES, POINTS, 3), 0.1 * normal(SHAPES, POINTS), part)
    return torch.tensor([3, 0, 4, 2, 1]), drawn, poses


@pytest.mark.parametrize("inter_over", ["held", "all"])
@pytest.mark.parametrize("at_once", [1, 2, 3, 5, 9])
def test_gradients_and_terms_are_those_of_the_whole_batch(at_once: int, inter_over: str) -> None:
    torch.manual_seed(0)
    model = AutoDecoder(SHAPES, PARTS, DECODER).double()
    shapes, (points, sdf, part), poses = batch()
    with torch.no_grad():
        for parameter in model.decoder.parameters():
            parameter += 0.3 * torch.randn(parameter.shape, dtype=torch.float64)
        distances, _ = model(shapes, points, poses)
        model.decoder.single[-1].bias -= distances.median() + 1e-3  # of either sign, none 0
    distances, latents = model(shapes, points, poses)
    held = ((distances < 0).sum(dim=1) >= 2).sum(dim=1)
    assert len(held.unique()) > 2  # a mean of the shapes' means would be another one
    settings = config(at_once, inter_over)
    expected = terms(distances, sdf, part, settings.losses, DECODER)
    assert expected.inter > 0
    torch.testing.assert_close(expected.inter, intersection(distances, settings.losses))
    total = expected.total(settings.losses) + latent_penalty(latents, settings.losses, 50)
    wanted = torch.autograd.grad(total, list(model.parameters()))
    fabric = SimpleNamespace(backward=lambda loss: loss.backward(), world_size=1)
    found = backward(fabric, model, shapes, (points, sdf, part), poses, settings, 50)
    torch.testing.assert_close(torch.stack(found), torch.stack(expected).detach())
    for parameter, gradient in zip(model.parameters(), wanted, strict=True):
        torch.testing.assert_close(parameter.grad, gradient, rtol=1e-9, atol=1e-12)


def test_a_training_learns_the_same_a_few_shapes_at_a_time(lamps: PreparedFamily, tmp_path: Path) -> None:
    from partwright.partsdf.model import load_model

    whole = small_config(lamps, epochs=3, batch=6)
    slow = replace(whole, training=replace(whole.training, at_once=2))
    one, other = (train(c, tmp_path / name).model for c, name in ((whole, "one"), (slow, "other")))
    torch.testing.assert_close(one.latents, other.latents, rtol=0, atol=1e-3)
    assert load_model(tmp_path / "other" / MODEL).config.training.at_once == 2


def test_a_stopped_training_may_go_on_with_less_memory(lamps: PreparedFamily, tmp_path: Path) -> None:
    config = small_config(lamps, epochs=2, batch=6)

    def stop(_: EpochReport) -> None:
        signal.raise_signal(signal.SIGINT)

    assert train(config, tmp_path, progress=stop).outcome == "interrupted"
    slow = replace(config, training=replace(config.training, at_once=2))
    assert train(slow, tmp_path).outcome == "converged"


def test_several_devices_share_the_batch_anyway() -> None:
    with pytest.raises(SettingError, match="at_once is for one device"):
        TrainingSettings(at_once=1, devices=2, batch=4)
