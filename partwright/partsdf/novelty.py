"""How far a shape is from those that its model was trained on."""

from __future__ import annotations

from dataclasses import replace

import torch

from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.starts import nearest_trained
from partwright.partsdf.targets import Target

_PLACES, _NEAR, _SAMPLES = 8192, 0.05, 512


@torch.no_grad()
def nearest_training_shape(shape: NeuralShape) -> tuple[str, float]:
    """The training shape that differs least, and by how much: the mean difference of the clamped distances,
    unit lengths, at places within 0.05 of the shape's surface. At most the clamp (0.1)."""
    generator = torch.Generator().manual_seed(0)
    places = 2 * torch.rand(_PLACES, 3, generator=generator) - 1
    distance = torch.from_numpy(shape.distances(places.numpy()))
    rows = distance.abs().argsort()[:_SAMPLES]
    rows = rows[distance[rows].abs() < _NEAR] if (distance.abs() < _NEAR).any() else rows
    model = shape.model
    plain = replace(model, config=replace(model.config, losses=replace(model.config.losses, hard=0.0)))
    order = torch.randperm(len(rows), generator=generator)
    target = Target(places[rows][order], distance[rows][order])
    ((difference, nearest),) = nearest_trained(plain, target, count=len(rows))
    index = next(i for i in range(len(model.shapes)) if torch.equal(model.latents[i], nearest.latents))
    return model.shapes[index], difference
