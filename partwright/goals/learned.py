"""Learned parts: latents and half-lengths as parameters, and several parts decoded in one pass."""

from __future__ import annotations

import dataclasses
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor

from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Field
from partwright.fields.joint import JointField
from partwright.goals.entry import FORM, LATENT, Entry

_DEVIATIONS = 5.0  # of the latents in training: about what changes a part altogether


class LearnedForm:
    """Latent (Z,), then half-lengths (3,), of a part that a trained model decodes."""

    def __init__(self, field: JointField) -> None:
        self.own = cast(Any, field)

    def entries(self, longest: float) -> list[Entry]:
        model = self.own.network
        index = model.index(self.own.part)
        known = model.latents[model.present[:, index], index]
        spread = float(known.std(dim=0).mean()) if len(known) > 1 else 1.0
        result = [
            Entry(f"latent_{k}", LATENT, value, _DEVIATIONS * max(spread, 1e-6))
            for k, value in enumerate(self.own.latent)
        ]
        sizes = zip("xyz", self.own.half_lengths, strict=True)
        return result + [Entry(f"half_{axis}", FORM, v, longest, 0.02 * v) for axis, v in sizes]

    def field(self, values: np.ndarray) -> Field:
        latent, halves = values[:-3].tolist(), values[-3:].tolist()
        return cast(
            Field, dataclasses.replace(self.own, latent=tuple(latent), half_lengths=tuple(halves), members=())
        )

    def distance(self, points: Tensor, values: Tensor) -> Tensor:
        raise TypeError("learned parts are decoded together")


def decoded(
    leaves: list[tuple[Any, Tensor]], points: Tensor
) -> Tensor:  # leaves: parts of one shape and their parameters
    """Distances (Q, N) of the parts of one learned shape at points (N, 3) of the assembly's frame.

    leaves: the parts in their order, and their parameters as `Parameters` has them (a tensor each). Latents,
    places, turns (to first order) and half-lengths of all of them are differentiated through the model.
    """
    first = leaves[0][0]
    shape, unit = first.field.shape, first.field.unit
    model = shape.model
    frame = first.pose @ first.field.unit_frame
    turn = torch.tensor(rotation_matrix(frame.rotation), dtype=points.dtype)
    seen = ((points - points.new_tensor(frame.translation)) @ turn / unit).float()
    latents, poses = list(shape.latents), [list(each) for each in shape.poses]
    rows = []
    for part, theta in leaves:
        row = model.index(part.field.part)
        rows.append(row)
        moved = (theta[:3] - theta[:3].detach()) @ turn / unit
        latents[row] = theta[6:-3].float()
        poses[0][row] = poses[0][row] + moved.float()
        poses[1][row] = _turned(poses[1][row], theta[3:6].float())
        poses[2][row] = (theta[-3:] / unit).float()
    placed = type(shape.poses)(*(torch.stack(each) for each in poses))
    each = model.part_distances(torch.stack(latents), placed, seen)
    return (unit * each[torch.tensor(rows)]).to(points.dtype)


def _turned(q: Tensor, w: Tensor) -> Tensor:
    """q times (1, w / 2): a turn of a small vector in the part's own frame."""
    x, y, z = w / 2
    zero = torch.zeros_like(x)
    a, b, c, d = q
    change = torch.stack(
        [-b * x - c * y - d * z, a * x + c * z - d * y, a * y - b * z + d * x, a * z + b * y - c * x]
    )
    return q + change + zero
