"""One training step's gradients, a few shapes at a time where memory is short.

The shapes of a batch meet in one place only: L_inter (eq. 9) is a mean over the points of all shapes that
several parts hold, unless `losses.inter_over` is "all". So the rest goes backward a few shapes at a time, and
those points, seldom many, go through the decoder once more when their number is known: the gradient is that
of the whole batch.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from partwright.partsdf.config import Config
from partwright.partsdf.losses import LossTerms, held_by_several, intersection, latent_penalty, terms
from partwright.partsdf.poses import PoseTensors

Drawn = tuple[Tensor, Tensor, Tensor]  # points (B, N, 3), their distances (B, N) and nearest parts (B, N)


def backward(
    fabric: Any,
    model: Any,
    shapes: Tensor,
    drawn: Drawn,
    poses: PoseTensors,
    config: Config,
    epoch: float,
    weight: float = 1.0,
) -> LossTerms:
    """Adds the gradients of eq. 6 to those of the model, and returns the terms.

    Over several processes, whose gradients are averaged, both are those of the whole batch.

    Args:
        model: an `AutoDecoder`, set up by `fabric`.
        shapes: (B,) indices of the latents.
        drawn: samples of each shape.
        poses: of the parts of each shape (B, P).
        config: `training.at_once` shapes go through the decoder together, all where it is 0.
        epoch: for the ramp of the latent term.
        weight: of this process: its part of the batch times the number of processes; 0 if its shapes are
            another's.
    """
    meeting = config.losses.inter_over == "held"
    most, losses = config.training.at_once or len(shapes), config.losses
    found = LossTerms(*drawn[1].new_zeros(3))
    several = torch.zeros(drawn[1].shape, dtype=torch.bool, device=shapes.device)
    for first in range(0, len(shapes), most):
        some = slice(first, first + most)
        points, sdf, part = (tensor[some] for tensor in drawn)
        distances, latents = model(shapes[some], points, poses.map(lambda t, some=some: t[some]))
        each = terms(distances, sdf, part, losses, config.decoder)
        penalty = latent_penalty(latents, losses, epoch)
        share = len(points) / len(shapes)
        if share == 1 and fabric.world_size == 1:
            fabric.backward(each.total(losses) + penalty)
            return LossTerms(*(term.detach() for term in each))
        if fabric.world_size > 1:
            held = held_by_several(distances.detach()).sum() * (weight > 0)
            shared = held / _mean(fabric, held).clamp(min=1 / fabric.world_size) if meeting else weight
            each = LossTerms(weight * each.whole, weight * each.part, shared * each.inter)
            # A sum over shapes, which an average over processes would divide.
            fabric.backward(each.total(losses) + (fabric.world_size if weight else 0) * penalty)
            return LossTerms(*_mean(fabric, torch.stack([term.detach() for term in each])))
        apart = each._replace(inter=torch.zeros_like(each.inter)) if meeting else each
        fabric.backward(share * apart.total(losses) + penalty)
        found = LossTerms(*(sum_ + share * term.detach() for sum_, term in zip(found, apart, strict=True)))
        several[some] = held_by_several(distances.detach())
    if not meeting:
        return found
    return found._replace(inter=_inter(fabric, model, shapes, drawn[0], poses, config, several))


def _mean(fabric: Any, value: Tensor) -> Tensor:
    """Over all processes."""
    mean: Tensor = fabric.all_reduce(value.float(), reduce_op="mean")
    return mean


def _inter(
    fabric: Any,
    model: Any,
    shapes: Tensor,
    points: Tensor,
    poses: PoseTensors,
    config: Config,
    several: Tensor,
) -> Tensor:
    """L_inter and its gradient, of the points (B, N) that several parts hold, one shape at a time."""
    result, whole = points.new_zeros(()), several.sum().clamp(min=1)
    for i in several.any(dim=1).nonzero().squeeze(1).tolist():
        held = points[i, several[i]][None]
        one = slice(i, i + 1)
        distances, _ = model(shapes[one], held, poses.map(lambda t, one=one: t[one]))
        term = intersection(distances, config.losses) * several[i].sum() / whole
        fabric.backward(config.losses.inter * term)
        result += term.detach()
    return result
