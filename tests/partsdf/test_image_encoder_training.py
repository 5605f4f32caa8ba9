"""A step of an image encoder's training."""

from __future__ import annotations

import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.encoder import EncoderSettings
from partwright.partsdf.image_encoder import ImageNetwork, ImageSettings
from partwright.partsdf.image_encoder_training import picture_losses
from partwright.partsdf.latent_metric import felt
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.views import PartMeshes, draw_views

SETTINGS = ImageSettings((8, 8, 16), EncoderSettings(width=16, heads=2, rounds=1, blocks=1, beside=2))


def test_a_processor_learns_in_single_precision(model: Model, lamps: PreparedFamily) -> None:
    """Of what it has no instructions for, as half precision, a step takes ten times as long."""
    vectors = PartVectors.of(model)
    network = ImageNetwork(len(model.parts), vectors.width, SETTINGS)
    seen = draw_views(PartMeshes.of(lamps, model), model, 2, torch.Generator().manual_seed(1))
    types: set[torch.dtype] = set()
    for module in network.modules():
        if isinstance(module, torch.nn.Conv2d | torch.nn.Linear):
            module.register_forward_hook(lambda _, __, out: types.add(out.dtype))
    losses = picture_losses(
        network, vectors, felt(model, vectors), model, seen, torch.arange(2), torch.Generator().manual_seed(2)
    )
    assert types == {torch.float32}
    assert losses.isfinite().all()
