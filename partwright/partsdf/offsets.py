"""How two parts' boxes lie to each other, against the range that training shapes show."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import torch
from torch import Tensor

from partwright.partsdf.poses import PoseTensors, rotation_matrices

if TYPE_CHECKING:
    from partwright.partsdf.model import Model

_SLACK = 0.1  # of the training shapes' range, by which two parts may lie beyond it


class OffsetRange(NamedTuple):
    """Of all pairs of parts, first (Q,) and second (Q,): between what the sides of the first ones' boxes lie
    beyond those of the second ones' in training shapes, low and high (Q, 12), with some slack; and whether a
    training shape has both, known (Q,)."""

    first: Tensor
    second: Tensor
    low: Tensor
    high: Tensor
    known: Tensor

    @classmethod
    def of(cls, poses: PoseTensors, present: Tensor) -> OffsetRange:
        """Of training shapes' poses (S, P, ...) and which parts they have, present (S, P)."""
        parts = present.shape[1]
        first, second = torch.triu_indices(parts, parts, 1)
        there = (present[:, first] & present[:, second])[..., None]
        sides = _sides(poses, first, second)
        known = there.any(dim=0)
        low = torch.where(there, sides, torch.inf).amin(dim=0)
        high = torch.where(there, sides, -torch.inf).amax(dim=0)
        low, high = (torch.where(known, end, 0.0) for end in (low, high))
        slack = _SLACK * (high - low)
        return cls(first, second, low - slack, high + slack, known.squeeze(-1))


def beyond_range(model: Model, poses: PoseTensors, present: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """How far beyond the training shapes' range the sides of two parts' boxes lie to each other, along the
    axis of the family's frame where it is most: (Q,) unit lengths, of the parts first (Q,) and second (Q,).

    At most 0 within the range; -inf of two parts that are not both there, or in no training shape together.
    poses (P, ...) and present (P,): of the shape, in the family's frame.
    """
    first, second, low, high, known = model.offset_range
    own = _sides(poses.map(lambda t: t[None]), first, second)[0]
    both = present[first] & present[second] & known
    beyond = torch.maximum(low - own, own - high).amax(dim=-1)
    return beyond.masked_fill(~both, -torch.inf), first, second


def _sides(poses: PoseTensors, first: Tensor, second: Tensor) -> Tensor:
    """(S, Q, 12) of poses (S, P, ...): by how much the low and high sides of the first parts' boxes (Q,) lie
    beyond those of the second ones', along each axis."""
    half = (rotation_matrices(poses.rotation).abs() @ poses.scale[..., None]).squeeze(-1)
    sides = torch.stack([poses.translation - half, poses.translation + half], dim=-2)  # (S, P, 2, 3)
    return (sides[:, first, :, None] - sides[:, second, None]).flatten(2)
