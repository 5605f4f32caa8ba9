"""Shapes that the model has not seen: latents, and poses where they are unknown, that decode to them.

With known parts the poses are given and every sample knows its nearest part (section 4.1). Part-agnostic, a
plain surface is all there is: latents and poses, rotations included, start from the training shape that fits
best as it is, and all of them move (section 3.4, without the encoder).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from partwright.datasets.prepared import PreparedShape
from partwright.errors import CancelledError, ModelError
from partwright.methods import Cancellation, Checkpoint
from partwright.partsdf.config import LossSettings
from partwright.partsdf.data import pose_tensors, present_parts
from partwright.partsdf.losses import aggregate, clamped_error, latent_penalty, terms
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors, local_points
from partwright.partsdf.settings import ReconstructionSettings
from partwright.shapes import Shape


class Step(NamedTuple):
    """One iteration, the `number`th `of` all."""

    number: int
    of: int
    loss: float
    shape: Callable[[], NeuralShape]
    """Makes the shape as it is now."""


Told = Callable[[Step], None]


@dataclass(frozen=True)
class Target:
    """Samples of one shape, unit frame: points (N, 3), sdf (N,), and the nearest part (N,) where known."""

    points: Tensor
    sdf: Tensor
    part: Tensor | None = None

    @classmethod
    def of_shape(cls, shape: Shape, count: int = 40_000, seed: int = 0) -> Target:
        """Of any shape that comes in: near its surface with the paper's two variances, and around it."""
        samples = shape.samples(round(0.95 * count), round(0.05 * count), seed, NEAR)
        return cls(torch.tensor(samples.points), torch.tensor(samples.distance))

    def halves(self) -> tuple[Tensor, Tensor]:
        """Rows that lie inside and outside; each draw takes half of its points from either."""
        inside = self.sdf < 0
        return inside.nonzero().squeeze(1), (~inside).nonzero().squeeze(1)


LEAST = 1e-3
_SCOUTED = 8  # of the iterations, the part that each start is given
NEAR = (0.005**0.5, 0.0005**0.5)  # section B.4 gives variances


def reconstruct(
    model: Model,
    shape: Shape | PreparedShape,
    settings: ReconstructionSettings | None = None,
    seed: int = 0,
    told: Told | None = None,
    cancel: Cancellation | None = None,
) -> NeuralShape:
    """The latents and poses that decode to a shape. A prepared shape has known parts, another has not.

    seed: of the samples drawn. told: of each iteration. cancel: ends it with what was found.

    Raises:
        ModelError: the prepared shape has other parts than the model.
    """
    checkpoint, settings = Checkpoint(cancel or Cancellation()), settings or ReconstructionSettings()
    if isinstance(shape, Shape):
        return reconstruct_unknown(model, Target.of_shape(shape, seed=seed), settings, seed, told, checkpoint)
    count = 1 if model.config.one_part else len(shape.present)
    if count != len(model.parts):
        raise ModelError(
            f"{shape.name} has {count} parts, but {model.name} knows {len(model.parts)}: "
            f"{', '.join(model.parts)}; take the model of its family"
        )
    part = torch.zeros(len(shape.part)) if model.config.one_part else torch.tensor(shape.part)
    target = Target(torch.tensor(shape.points), torch.tensor(shape.sdf), part.long())
    start = NeuralShape.mean(model, present_parts(shape, model.config))
    # Latents start at N(0, 0.01^2), as the authors': near the centre of their prior.
    noise = torch.Generator().manual_seed(seed)
    latents = 0.01 * torch.randn(start.latents.shape, generator=noise)
    start = replace(start, latents=latents, poses=pose_tensors(shape, model.config))
    return _optimised(start, target, settings, seed, told, checkpoint, move_poses=False)[0]


def reconstruct_unknown(
    model: Model,
    target: Target,
    settings: ReconstructionSettings | None = None,
    seed: int = 0,
    told: Told | None = None,
    checkpoint: Checkpoint | None = None,
) -> NeuralShape:
    """Latents and poses, without knowing which part a sample belongs to.

    Once the checkpoint's cancellation is requested, it ends with what was found.
    """
    settings = settings or ReconstructionSettings()
    if settings.start == "nearest":
        starts = nearest_trained(model, target, settings.starts)
    else:
        starts = [NeuralShape.mean(model)]
    starts = [replace(start, present=torch.ones_like(start.present)) for start in starts]
    found = _scouted(starts, target, settings, seed, told, checkpoint)
    return replace(found, present=_filling(found, target))


@torch.no_grad()
def _filling(shape: NeuralShape, target: Target) -> Tensor:
    """(P,) parts that fill at least `LEAST` of the target's inside: what is less is a crumb of a part that
    should not be there (section 5)."""
    inside = target.points[target.sdf < 0]
    if not len(inside):
        return shape.present
    owner = shape.part_distances(inside.numpy()).argmin(axis=0)
    share = torch.from_numpy(np.bincount(owner, minlength=len(shape.present)) / len(inside))
    return share >= LEAST


def _scouted(
    starts: list[NeuralShape],
    target: Target,
    settings: ReconstructionSettings,
    seed: int = 0,
    told: Told | None = None,
    checkpoint: Checkpoint | None = None,
) -> NeuralShape:
    """From the start that a few iterations bring closest: one that is close as it is may be a dead end, as a
    tube with flanges is for one without."""
    few = replace(settings, iterations=max(1, settings.iterations // _SCOUTED), decay=1.0)
    scouts = starts if len(starts) > 1 else []
    steps = settings.iterations + len(scouts) * few.iterations

    def after(done: int) -> Told | None:
        return told and (lambda step: told(step._replace(number=done + step.number, of=steps)))

    tried: list[NeuralShape] = []
    for i, start in enumerate(scouts):
        ahead = after(i * few.iterations)
        shape, finished = _optimised(start, target, few, seed, ahead, checkpoint, start.model.config.poses)
        tried.append(shape)
        if not finished:
            return _closest(tried, target)
    best = _closest(tried or starts, target)
    ahead = after(len(scouts) * few.iterations)
    return _optimised(best, target, settings, seed, ahead, checkpoint, best.model.config.poses)[0]


def _closest(shapes: list[NeuralShape], target: Target) -> NeuralShape:
    return shapes[0] if len(shapes) == 1 else min(shapes, key=lambda one: _error(one, target))


@torch.no_grad()
def _error(shape: NeuralShape, target: Target, count: int = 8192) -> float:
    """Mean error of the whole shape's distance, at `count` of the target's samples."""
    rows = torch.linspace(0, len(target.sdf) - 1, min(count, len(target.sdf))).long()
    whole = torch.from_numpy(shape.distances(target.points[rows].numpy()))
    return float(clamped_error(whole, target.sdf[rows], shape.model.config.losses).mean())


@torch.no_grad()
def nearest_trained(model: Model, target: Target, most: int = 1, count: int = 512) -> list[NeuralShape]:
    """The `most` training shapes whose distances differ least from the target's, at `count` of its points.

    A quarter of the points tells which of them come into question at all.
    """
    rows = torch.linspace(0, len(target.sdf) - 1, count).long()
    everyone = torch.arange(len(model.latents))
    likely = _errors_of_trained(model, target, rows[::4], everyone).argsort()
    likely = likely[: max(4 * most, len(likely) // 8)]
    order = likely[_errors_of_trained(model, target, rows, likely).argsort()]
    return [NeuralShape.trained(model, str(int(i))) for i in order[:most]]


def _errors_of_trained(model: Model, target: Target, rows: Tensor, numbers: Tensor) -> Tensor:
    """Mean error (S,) of training shapes, by their numbers (S,), at the target's samples `rows`."""
    points, sdf = target.points[rows], target.sdf[rows]
    errors = []
    for some in numbers.split(16):
        poses = PoseTensors(*(t[some] for t in model.poses))
        each = model.condition(model.latents[some], poses)(local_points(points, poses))
        whole = aggregate(each, model.config.decoder)
        errors.append(clamped_error(whole, sdf.expand_as(whole), model.config.losses).mean(dim=1))
    return torch.cat(errors)


def _optimised(
    start: NeuralShape,
    target: Target,
    settings: ReconstructionSettings,
    seed: int,
    told: Told | None,
    checkpoint: Checkpoint | None,
    move_poses: bool,
) -> tuple[NeuralShape, bool]:
    """Adam on the latents, and on the poses if they are to move; a cancellation keeps what was found. Also
    whether all iterations were done."""
    losses = start.model.config.losses
    latents = start.latents.clone().requires_grad_()
    poses = start.poses.map(lambda t: t.clone().requires_grad_(move_poses))
    # Half-lengths move by their logarithm: they stay positive, and long and short sides alike.
    size = start.poses.scale.log().requires_grad_(move_poses)
    groups = [{"params": [latents], "lr": settings.rate}]
    if move_poses:
        groups.append({"params": [poses.translation, poses.rotation, size], "lr": settings.pose_rate})
    optimiser = torch.optim.Adam(groups)
    generator = torch.Generator().manual_seed(seed)
    halves = target.halves()

    def found() -> NeuralShape:
        final = PoseTensors(poses.translation, poses.rotation, size.exp()) if move_poses else start.poses
        unit = final.rotation / final.rotation.norm(dim=-1, keepdim=True)
        placed = final._replace(rotation=unit).map(lambda t: t.detach().clone())
        return replace(start, latents=latents.detach().clone(), poses=placed)

    try:
        for i in range(settings.iterations):
            if i == settings.iterations // 2:
                for group in optimiser.param_groups:
                    group["lr"] *= settings.decay
            moved = move_poses and i >= settings.pose_delay * settings.iterations
            now = poses._replace(scale=size.exp()) if moved else start.poses
            rows = _drawn(halves, settings.points, generator)
            late = 2 * i >= settings.iterations
            loss = _loss(start, latents, now, target, rows, losses, late)
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
    shape: NeuralShape,
    latents: Tensor,
    poses: PoseTensors,
    target: Target,
    rows: Tensor,
    losses: LossSettings,
    late: bool,
) -> Tensor:
    """Eq. 6 at some samples; with known parts the whole shape's loss waits for the second half."""
    each = shape.model.part_distances(latents, poses, target.points[rows])[None]
    sdf = target.sdf[rows][None]
    known = target.part is not None
    part = target.part[rows][None] if target.part is not None else torch.zeros_like(sdf).long()
    found = terms(each, sdf, part, losses, shape.model.config.decoder)
    weights = losses if late or not known else replace(losses, whole=0.0)
    return found.total(weights, known) + latent_penalty(latents, losses, losses.ramp)


def _drawn(halves: tuple[Tensor, Tensor], count: int, generator: torch.Generator) -> Tensor:
    """`count` rows, half of them inside as far as there are any."""
    some = [half for half in halves if len(half)]
    return torch.cat(
        [half[torch.randint(len(half), (count // len(some),), generator=generator)] for half in some]
    )
