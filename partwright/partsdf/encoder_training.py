"""How an encoder learns, the decoder frozen: from the latents and poses that the training shapes have."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from partwright.datasets.prepared import PreparedFamily
from partwright.errors import SettingError
from partwright.methods import Cancellation
from partwright.partsdf.clouds import Drawn, PartClouds, draw
from partwright.partsdf.encoder import Encoder, EncoderNetwork, EncoderSettings
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import POSE, PartVectors

_BATCH, _DECAY, _WARMUP = 24, 1e-2, 50
_POINTS = (64, 128, 256, 512)  # of a step's clouds
_POSE, _PRESENCE = 1.0, 1.0  # weights beside the latents'
_TOLD = 20  # steps


@dataclass(frozen=True)
class EncoderStep:
    """latents: share of their variance that is not predicted yet; poses: mean error, in their spreads;
    presence: cross-entropy."""

    number: int
    of: int
    latents: float
    poses: float
    presence: float


def train_encoder(
    model: Model,
    family: PreparedFamily,
    *,
    steps: int = 5000,
    rate: float = 1e-3,
    seed: int = 0,
    settings: EncoderSettings | None = None,
    told: Callable[[EncoderStep], None] | None = None,
    cancel: Cancellation | None = None,
) -> Encoder:
    """An encoder for a model, from the prepared family that it was trained on; after a cancellation, as far
    as it has come.

    Raises:
        FamilyError: it is another family, or was prepared without surfaces.
        SettingError: fewer than one step, or a model of one part, which has no poses.
    """
    if steps < 1:
        raise SettingError(f"steps is {steps}; expected 1 or more")
    if model.config.one_part or not model.config.poses:
        raise SettingError(f"{model.name} was trained without poses, which an encoder predicts")
    clouds = PartClouds.of(family, model)
    settings, cancel = settings or EncoderSettings(), cancel or Cancellation()
    torch.manual_seed(seed)
    vectors = PartVectors.of(model)
    network = EncoderNetwork(len(model.parts), vectors.width, settings)
    optimiser = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=_DECAY, fused=True)
    generator = torch.Generator().manual_seed(seed)
    sums, since = torch.zeros(3), 0
    for step in range(steps):
        if cancel.requested:
            break
        late = 0.5 * (1 + math.cos(math.pi * step / steps))
        optimiser.param_groups[0]["lr"] = rate * late * min(1.0, (step + 1) / _WARMUP)
        shapes = torch.randint(len(model.shapes), (_BATCH,), generator=generator)
        count = _POINTS[int(torch.randint(len(_POINTS), (), generator=generator))]
        drawn = draw(clouds, model, shapes, count, generator)
        terms = losses(network(drawn.points), drawn, vectors)
        optimiser.zero_grad()
        (terms[0] + _POSE * terms[1] + _PRESENCE * terms[2]).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        sums, since = sums + terms.detach(), since + 1
        if told and (since == _TOLD or step + 1 == steps):
            told(EncoderStep(step + 1, steps, *(sums / since).tolist()))
            sums, since = torch.zeros(3), 0
    return Encoder(model, settings, network.requires_grad_(False).eval(), vectors)


def losses(found: Tensor, drawn: Drawn, vectors: PartVectors) -> Tensor:
    """(3,) of latents, poses and presence, of what a network gave (B, P, K + 12 + 1) for clouds."""
    latents, poses, logits = found.split((vectors.width, POSE, 1), dim=-1)
    there = drawn.present.float()
    count = there.sum().clamp(min=1)
    off = (latents - vectors.of_latents(drawn.latents)) * vectors.spread  # each direction as it tells
    unexplained = off.square().sum(-1) / vectors.spread.square().sum(-1)
    missed = torch.nn.functional.smooth_l1_loss(
        poses, vectors.of_poses(drawn.poses), reduction="none", beta=0.3
    )
    presence = torch.nn.functional.binary_cross_entropy_with_logits(logits.squeeze(-1), there)
    return torch.stack(
        [(unexplained * there).sum() / count, (missed.mean(-1) * there).sum() / count, presence]
    )
