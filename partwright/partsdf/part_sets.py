"""Which parts a new shape has: as a training shape, drawn before any pose is made.

A family's parts go together, as a cargo bed and no rear window; a diffusion of numbers that stand for yes and
no lets them go at times, and gives a shape a set of parts that no other has.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from partwright.partsdf.diffusion import levels, noised


class Near(NamedTuple):
    """A set of parts (P,) and how far from it new ones are, above 0 and at most 1: the time of the noise."""

    present: Tensor
    change: float


def drawn_sets(
    trained: Tensor, chance: Tensor, noise: Tensor, kept: Tensor, near: Near | None = None
) -> Tensor:
    """Sets of parts (B, P), each by its chance (B,) below 1, of those of training shapes (N, P).

    Those that have most of the parts `kept` (P,) are drawn from, and these are added. Near a set, it takes
    part, and each set is as likely as it is to come to the same noisy numbers, by noise (B, P).
    """
    common = (trained & kept).sum(dim=1)
    weights = (common == common.max()).double().expand(len(chance), -1)
    if near is not None:
        time = torch.full((len(noise),), near.change)
        trained = torch.cat([trained, near.present[None]])
        weights = torch.cat([weights, torch.full((len(chance), 1), 1 - near.change)], dim=1)
        at, _ = noised((2.0 * near.present - 1).expand_as(noise), noise, time)
        signal, spread = (one[:, None] for one in levels(time))
        apart = (at[:, None] - signal[..., None] * (2.0 * trained - 1)).square().sum(dim=2)
        weights = weights * torch.softmax((-apart / (2 * spread**2)).double(), dim=1)
    up_to = weights.cumsum(dim=1)
    row = torch.searchsorted(up_to, chance.double()[:, None] * up_to[:, -1:], right=True).squeeze(1)
    return trained[row.clamp(max=len(trained) - 1)] | kept
