"""Poses of noise, brought to lie to one another as in the family, before any form is made for them.

The poses of a new shape are nearly the family's, but a mirror may stand a little farther from the windscreen
than in any training shape: where two parts do, by more than a person would pass, all poses move a little, in
the family's spread, until none does, or for a number of steps.
"""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.partsdf.model import Model
from partwright.partsdf.offsets import beyond_range
from partwright.partsdf.part_vectors import POSE, PartVectors

OFFSET = 0.03  # unit lengths beyond the training shapes' range: farther off, two parts lie oddly
_WITHIN = 0.01  # of those that were moved, in the end
_STEPS, _RATE = 150, 0.02  # of a number's spread
_HOLD = 0.1  # weight of the mean squared way, in spreads, against unit lengths


@torch.enable_grad()
def within_range(
    model: Model, vectors: PartVectors, layout: Tensor, fixed: Tensor, like: Tensor | None = None
) -> Tensor:
    """Layouts (B, P, 13), as the generator's; those in which no two parts lie oddly are as they were, and so
    are poses of the parts `fixed` (P,). Two parts that lie oddly in the layout `like` (P, 13), too, may."""
    if fixed.all() or not model.config.poses:
        return layout
    first, second = model.offset_range.first, model.offset_range.second
    still = fixed[first] & fixed[second]
    if like is not None:
        still |= beyond_range(model, vectors.poses(like[:, :POSE]), like[:, -1] > 0)[0] > OFFSET
    return torch.stack([_within(model, vectors, one, fixed[:, None], still) for one in layout])


def _within(model: Model, vectors: PartVectors, layout: Tensor, fixed: Tensor, still: Tensor) -> Tensor:
    """still: pairs of parts (Q,) that may lie as they do."""
    present, begun = layout[:, -1] > 0, layout[:, :POSE]
    moved = begun.clone().requires_grad_()
    optimiser = torch.optim.Adam([moved], lr=_RATE)
    allowed = OFFSET
    for _ in range(_STEPS):
        placed = torch.where(fixed, begun, moved)
        beyond = beyond_range(model, vectors.poses(placed), present)[0].masked_fill(still, -torch.inf)
        if not (beyond > allowed).any():
            break
        allowed = _WITHIN
        optimiser.zero_grad()
        (torch.relu(beyond).sum() + _HOLD * (placed - begun).square().mean()).backward()
        optimiser.step()
    return torch.cat([torch.where(fixed, begun, moved.detach()), layout[:, -1:]], dim=1)
