"""Latents and poses, moved until they decode to a target: what known parts, unknown ones and those that are
freed of the family's spread have in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor

from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION
from partwright.errors import CancelledError
from partwright.methods import Checkpoint
from partwright.partsdf.losses import aggregate, intersection, terms
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import FreeUnknowns, Unknowns, unknowns_of

_ABSENT = 10.0  # unit lengths to a part that is not there


class Step(NamedTuple):
    """One iteration, the `number`th `of` all."""

    number: int
    of: int
    loss: float
    shape: Callable[[], NeuralShape]
    """Makes the shape as it is now."""
    turn: Quaternion = NO_ROTATION
    """From how the shape's family stands to how the target does."""


Told = Callable[[Step], None]


def poses_move(model: Model, settings: ReconstructionSettings) -> bool:
    """Whether poses move."""
    return model.config.poses and settings.pose_rate > 0


def optimised(
    start: NeuralShape,
    target: Target,
    settings: ReconstructionSettings,
    seed: int,
    told: Told | None,
    checkpoint: Checkpoint | None,
    move_poses: bool,
    freely: bool = False,
) -> tuple[NeuralShape, bool]:
    """Adam on the latents, and on the poses if they are to move; a cancellation keeps what was found. Also
    whether all iterations were done. freely: by themselves, not along the family's directions,
    and none of parts that are not there."""
    unknowns: Unknowns = (
        FreeUnknowns(start, move_poses, start.present) if freely else unknowns_of(start, move_poses, target)
    )
    optimiser = torch.optim.Adam(unknowns.groups(settings))
    generator = torch.Generator().manual_seed(seed)
    halves = target.halves()

    def found() -> NeuralShape:
        final = unknowns.poses()
        unit = final.rotation / final.rotation.norm(dim=-1, keepdim=True)
        placed = final._replace(rotation=unit).map(lambda t: t.detach().clone())
        return replace(start, latents=unknowns.latents().detach().clone(), poses=placed)

    try:
        for i in range(settings.iterations):
            if i == settings.iterations // 2:
                for group in optimiser.param_groups:
                    group["lr"] *= settings.decay
            moved = move_poses and i >= settings.pose_delay * settings.iterations
            rows = _drawn(halves, settings.points, generator)
            loss = _loss(start, unknowns, moved, target, rows, late=2 * i >= settings.iterations)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            if told:
                told(Step(i + 1, settings.iterations, float(loss.detach()), found))
            if checkpoint:
                checkpoint()
    except CancelledError:
        return found(), False
    return found(), True


def _loss(
    shape: NeuralShape, unknowns: Unknowns, moved: bool, target: Target, rows: Tensor, late: bool
) -> Tensor:
    """Eq. 6 at some samples; with known parts the whole shape's loss waits for the second half.

    moved: whether poses move by now.
    """
    poses = unknowns.poses() if moved else shape.poses
    each = shape.model.part_distances(unknowns.latents(), poses, target.points[rows])[None]
    if target.part is None:
        each = each.masked_fill(~shape.present[:, None], _ABSENT)
    decoder, losses = shape.model.config.decoder, shape.model.config.losses
    sdf = target.sdf[rows]
    if target.low is not None:
        whole = aggregate(each, decoder)[0]
        on_surface = float(whole.detach().abs()[sdf <= 0].mean())
        error = losses.whole * target.error(whole, rows, losses).mean()
        return error + losses.inter * intersection(each, losses) + unknowns.prior(on_surface, moved)
    known = target.part is not None
    part = target.part[rows] if target.part is not None else torch.zeros_like(sdf).long()
    found = terms(each, sdf[None], part[None], losses, decoder)
    weights = losses if late or not known else replace(losses, whole=0.0)
    return found.total(weights, known) + unknowns.prior(0.0, moved)


def _drawn(halves: tuple[Tensor, Tensor], count: int, generator: torch.Generator) -> Tensor:
    """`count` rows, half of them inside as far as there are any."""
    some = [half for half in halves if len(half)]
    return torch.cat(
        [half[torch.randint(len(half), (count // len(some),), generator=generator)] for half in some]
    )
