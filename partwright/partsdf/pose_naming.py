"""Poses of a prepared shape as a model names them.

A box has 24 names: which of its axes is x, and which way, is agreed on by all shapes that are prepared
together. A family that was prepared apart from the one that a model was trained on may have agreed otherwise,
and a part that is turned by a quarter or a half in its own frame is another form to the decoder.
"""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.datasets.agreement import AXIS_NAMINGS
from partwright.partsdf.part_vectors import quaternions
from partwright.partsdf.poses import PoseTensors, rotation_matrices


def named_like(poses: PoseTensors, reference: PoseTensors) -> PoseTensors:
    """The same boxes (P, ...), the axes of each named so that it agrees best with the reference's: least sum
    of squared angle and squared difference of the half-lengths' logarithms. What agrees as it is stays, to
    the bit."""
    namings = torch.from_numpy(AXIS_NAMINGS).float()
    turned = rotation_matrices(poses.rotation)[:, None] @ namings  # (P, 24, 3, 3)
    sizes = (namings.abs().mT @ poses.scale[:, None, :, None]).squeeze(-1)
    cosine = ((turned * rotation_matrices(reference.rotation)[:, None]).sum(dim=(-1, -2)) - 1) / 2
    apart = (sizes.log() - reference.scale.log()[:, None]).square().sum(dim=-1)
    costs = cosine.clamp(-1, 1).arccos().square() + apart
    as_it_is = int((namings - torch.eye(3)).abs().sum(dim=(1, 2)).argmin())
    best = costs.argmin(dim=1)

    def chosen(each: Tensor) -> Tensor:
        return each[torch.arange(len(best)), best]

    same = (best == as_it_is)[:, None]
    rotation = torch.where(same, poses.rotation, quaternions(chosen(turned)))
    return PoseTensors(poses.translation, rotation, torch.where(same, poses.scale, chosen(sizes)))
