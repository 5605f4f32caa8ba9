"""How two parts' boxes lie to each other, against the range that training shapes show."""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.partsdf.model import Model
from partwright.partsdf.poses import PoseTensors, rotation_matrices

_SLACK = 0.1  # of the training shapes' range, by which two parts may lie beyond it


def beyond_range(model: Model, poses: PoseTensors, present: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """How far beyond the training shapes' range the sides of two parts' boxes lie to each other, along the
    axis of the family's frame where it is most: (Q,) unit lengths, of the parts first (Q,) and second (Q,).

    At most 0 within the range; -inf of two parts that are not both there, or in no training shape together.
    poses (P, ...) and present (P,): of the shape, in the family's frame.
    """
    first, second = torch.triu_indices(len(model.parts), len(model.parts), 1)
    there = (model.present[:, first] & model.present[:, second])[..., None]
    known = _sides(model.poses, first, second)
    low = torch.where(there, known, torch.inf).amin(dim=0)
    high = torch.where(there, known, -torch.inf).amax(dim=0)
    own = _sides(poses.map(lambda t: t[None]), first, second)[0]
    both = present[first] & present[second] & there.any(dim=0).squeeze(-1)
    low, high = (torch.where(both[:, None], end, 0.0) for end in (low, high))
    beyond = torch.maximum(low - own, own - high) - _SLACK * (high - low)
    return beyond.amax(dim=-1).masked_fill(~both, -torch.inf), first, second


def _sides(poses: PoseTensors, first: Tensor, second: Tensor) -> Tensor:
    """(S, Q, 12) of poses (S, P, ...): by how much the low and high sides of the first parts' boxes (Q,) lie
    beyond those of the second ones', along each axis."""
    half = (rotation_matrices(poses.rotation).abs() @ poses.scale[..., None]).squeeze(-1)
    sides = torch.stack([poses.translation - half, poses.translation + half], dim=-2)  # (S, P, 2, 3)
    return (sides[:, first, :, None] - sides[:, second, None]).flatten(2)
