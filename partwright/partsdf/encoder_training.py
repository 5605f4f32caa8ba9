"""How an encoder learns, the decoder frozen: from the latents and poses that the training shapes have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from partwright.datasets.prepared import PreparedFamily
from partwright.devices import device_of
from partwright.methods import Cancellation
from partwright.partsdf.clouds import PartClouds, draw
from partwright.partsdf.companion_training import check_trainable, descend
from partwright.partsdf.encoder import Encoder, EncoderNetwork, EncoderSettings
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import POSE, PartVectors
from partwright.partsdf.poses import PoseTensors

BATCH = 24
_POINTS = (64, 128, 256, 512)  # of a step's clouds
_STEEPEST = 1.0  # norm of the gradients
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
    batch: int = BATCH,
    rate: float = 1e-3,
    seed: int = 0,
    device: str = "auto",
    settings: EncoderSettings | None = None,
    told: Callable[[EncoderStep], None] | None = None,
    cancel: Cancellation | None = None,
) -> Encoder:
    """An encoder for a model, from the prepared family that it was trained on; after a cancellation, as far
    as it has come.

    batch: clouds a step. device: "auto", "cpu" or "cuda".

    Raises:
        FamilyError: it is another family, or was prepared without surfaces.
        SettingError: fewer than one step or cloud, a model of one part, which has no poses, or no
            such device.
    """
    check_trainable(model, steps, batch, "an encoder predicts")
    place, settings = device_of(device), settings or EncoderSettings()
    vectors = PartVectors.of(model)
    known, own, clouds = vectors.to(place), model.to(place), PartClouds.of(family, model).to(place)
    torch.manual_seed(seed)
    generator = torch.Generator(place).manual_seed(seed)
    with place:
        network = EncoderNetwork(len(model.parts), vectors.width, settings)

    def terms() -> Tensor:
        with place:  # all that is drawn
            shapes = torch.randint(len(model.shapes), (batch,), generator=generator)
            count = _POINTS[int(torch.randint(len(_POINTS), (), generator=generator))]
            drawn = draw(clouds, own, shapes, count, generator)
            return losses(network(drawn.points), known, drawn.latents, drawn.poses, drawn.present)

    def heard(number: int, means: list[float]) -> None:
        if told is not None:
            told(EncoderStep(number, steps, *means))

    descend(
        network.parameters(), terms, steps=steps, rate=rate, told=heard, every=_TOLD, cancel=cancel,
        steepest=_STEEPEST,
    )  # fmt: skip
    return Encoder(model, settings, network.cpu().requires_grad_(False).eval(), vectors)


def losses(
    found: Tensor,
    vectors: PartVectors,
    latents: Tensor,
    poses: PoseTensors,
    present: Tensor,
    metric: Tensor | None = None,
) -> Tensor:
    """(3,) of latents, poses and presence, of what a network gave, (B, P, K + 12 + 1).

    latents (B, P, Z), poses (B, P, ...) and present (B, P): of what it saw. metric: (P, K, K) of `felt`, by
    which latents are off; the latents' own if None.
    """
    seen, posed, logits = found.split((vectors.width, POSE, 1), dim=-1)
    there = present.float()
    count = there.sum().clamp(min=1)
    off = seen - vectors.of_latents(latents)
    if metric is None:
        unexplained = (off * vectors.spread).square().sum(-1) / vectors.spread.square().sum(-1)
    else:
        unexplained = torch.einsum("bpk,pkm->bpm", off, metric).square().sum(-1)
    missed = torch.nn.functional.smooth_l1_loss(posed, vectors.of_poses(poses), reduction="none", beta=0.3)
    presence = torch.nn.functional.binary_cross_entropy_with_logits(logits.squeeze(-1), there)
    return torch.stack(
        [(unexplained * there).sum() / count, (missed.mean(-1) * there).sum() / count, presence]
    )
