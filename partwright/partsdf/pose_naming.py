"""Poses of a prepared shape as a model names them.

A box has 24 names: which of its axes is x, and which way, is agreed on by all shapes that are prepared
together. A family that was prepared apart from the one that a model was trained on may have agreed otherwise,
and a part that is turned by a quarter or a half in its own frame is another form to the decoder.
"""

from __future__ import annotations

import numpy as np
import torch

from partwright.datasets.agreement import Reference, costs, namings
from partwright.partsdf.part_vectors import quaternions
from partwright.partsdf.poses import PoseTensors, rotation_matrices


def named_like(poses: PoseTensors, reference: PoseTensors) -> PoseTensors:
    """The same boxes (P, ...), the axes of each named so that it agrees best with the reference's: least sum
    of squared angle and squared difference of the half-lengths' logarithms. What agrees as it is stays, to
    the bit."""
    turned, log_scales = namings(*_numbers(poses))
    rotation, log_scale = _numbers(reference)
    best = costs(turned, log_scales, Reference(rotation[:, None], log_scale[:, None])).argmin(axis=1)
    every = np.arange(len(best))
    named = torch.from_numpy(turned[every, best]), torch.from_numpy(np.exp(log_scales[every, best]))
    same = torch.from_numpy(best == 0)[:, None]
    rotations = torch.where(same, poses.rotation, quaternions(named[0].to(poses.rotation.dtype)))
    return PoseTensors(
        poses.translation, rotations, torch.where(same, poses.scale, named[1].to(poses.scale.dtype))
    )


def _numbers(poses: PoseTensors) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (P, 3, 3) and logarithms of half-lengths (P, 3)."""
    matrices = rotation_matrices(poses.rotation.detach())
    return matrices.double().numpy(), np.log(poses.scale.detach().double().numpy())
