"""What training and reconstruction minimise (PartSDF, eq. 6-9)."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from partwright.partsdf.config import DecoderSettings, LossSettings


class LossTerms(NamedTuple):
    """The terms of eq. 6, unweighted."""

    whole: Tensor
    part: Tensor
    inter: Tensor

    def total(self, settings: LossSettings, known_parts: bool = True) -> Tensor:
        """Weighted sum, without the latent term; `known_parts=False` leaves eq. 8 out (section 4.1)."""
        total = settings.whole * self.whole + settings.inter * self.inter
        return total + settings.part * self.part if known_parts else total


def terms(
    distances: Tensor, sdf: Tensor, part: Tensor, losses: LossSettings, decoder: DecoderSettings
) -> LossTerms:
    """Eq. 7-9 of part distances (B, P, N) against sdf (B, N), whose nearest part is `part` (B, N)."""
    nearest = distances.gather(1, part[:, None].long()).squeeze(1)
    return LossTerms(
        clamped_error(aggregate(distances, decoder), sdf, losses).mean(),
        clamped_error(nearest, sdf, losses).mean(),
        intersection(distances, losses),
    )


def aggregate(distances: Tensor, decoder: DecoderSettings) -> Tensor:
    """The whole shape's distance (B, N) of its parts' (B, P, N): their minimum, or a soft one (Table 7)."""
    if decoder.aggregation == "min":
        return distances.amin(dim=1)
    return -decoder.softness * torch.logsumexp(-distances / decoder.softness, dim=1)


def clamped_error(predicted: Tensor, sdf: Tensor, losses: LossSettings) -> Tensor:
    """|clamped predicted - clamped sdf|, errors towards the wrong side weighing up to 1 + hard.

    The prediction is clamped only where the target is, so that a wrong one always has a gradient.
    """
    clamp = losses.clamp
    predicted = torch.where(sdf >= clamp, predicted.clamp(max=clamp), predicted)
    predicted = torch.where(sdf <= -clamp, predicted.clamp(min=-clamp), predicted)
    error = sdf.clamp(-clamp, clamp) - predicted
    weight = 1 + losses.hard * sdf.sign() * error.detach().sign()
    return weight * error.abs()


def intersection(distances: Tensor, losses: LossSettings) -> Tensor:
    """L_inter (eq. 9) of distances (B, P, N): a mean over points inside two parts or more, else 0; or over
    all points, of which only these count, as `losses.inter_over` says.

    The softmax over the negative distances has no gradient: parts that reach in least are pushed out most.
    """
    negative, several = distances < 0, held_by_several(distances)[:, None]
    with torch.no_grad():
        logits = torch.where(negative & several, distances / losses.temperature, -torch.inf)
        weight = torch.softmax(torch.where(several, logits, 0.0), dim=1) * several
    among = several.sum().clamp(min=1) if losses.inter_over == "held" else several.numel()
    return -(weight * distances).sum() / among


def held_by_several(distances: Tensor) -> Tensor:
    """(B, N) whether two parts or more hold a point, of distances (B, P, N)."""
    return (distances < 0).sum(dim=1) >= 2


def latent_penalty(latents: Tensor, losses: LossSettings, epoch: float) -> Tensor:
    """lambda sum |z_p|^2 over batch and parts (eq. 6), ramped in over the first epochs."""
    ramp = min(1.0, epoch / losses.ramp) if losses.ramp else 1.0
    return ramp * losses.latent * latents.square().sum()
