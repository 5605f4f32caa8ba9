"""Shapes that the model has not seen: latents, and poses where they are unknown, that decode to them.

With known parts every sample knows its nearest part, and poses start as they are given (section 4.1).
Part-agnostic, a plain surface is all there is: latents and poses, rotations included, start from the training
shape that fits best as it is, and all of them move (section 3.4).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor

from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION
from partwright.datasets.prepared import PreparedShape
from partwright.errors import ModelError
from partwright.methods import Cancellation, Checkpoint
from partwright.partsdf.cores import one_core_each
from partwright.partsdf.data import pose_tensors, present_parts
from partwright.partsdf.familiarity import familiarity
from partwright.partsdf.freed import judged
from partwright.partsdf.model import Model
from partwright.partsdf.needless import needed
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.optimisation import Step, Told, optimised, poses_move
from partwright.partsdf.pose_naming import named_like
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.starts import (
    Start,
    errors_by_part,
    exchanged_parts,
    find_starts,
    latents_by_part,
)
from partwright.partsdf.targets import Target
from partwright.partsdf.unseen import with_unseen
from partwright.shapes import Shape

LEAST = 1e-3
_SCOUTED = 8  # of the iterations, the part that a start is given which comes into question
_BRIEF, _LIKELY = 32, 3  # the part that tells which ones do, where there are more than so many
_KNOWN = 4  # starts of known parts


@one_core_each()
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
    poses = pose_tensors(shape, model.config)
    if model.config.poses and not model.config.one_part:
        poses = named_like(poses, model.average_pose)
    start = replace(NeuralShape.mean(model, present_parts(shape, model.config)), poses=poses)
    if settings.exchange and settings.iterations:
        return _found_by_part(start, target, settings, seed, told, checkpoint)
    # Latents start at N(0, 0.01^2), as the authors': near the centre of their prior.
    noise = torch.Generator().manual_seed(seed)
    start = replace(start, latents=0.01 * torch.randn(start.latents.shape, generator=noise))
    return optimised(start, target, settings, seed, told, checkpoint, poses_move(model, settings))[0]


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
    found, _ = reconstruct_standing(model, target, [NO_ROTATION], settings, seed, told, checkpoint)
    return judged(found, target, settings, seed, checkpoint)[0]


@one_core_each()
def reconstruct_standing(
    model: Model,
    target: Target,
    turns: list[Quaternion],
    settings: ReconstructionSettings | None = None,
    seed: int = 0,
    told: Told | None = None,
    checkpoint: Checkpoint | None = None,
) -> tuple[NeuralShape, Quaternion]:
    """The shape as its family stands, along its directions, with parts that points do not show, and that one
    of the `turns` which brings it to where the target is."""
    settings = settings or ReconstructionSettings()
    starts = find_starts(model, target, turns, settings)
    found, turn = reconstruct_from(starts, settings, seed, told, checkpoint)
    return with_unseen(found, target.turned(turn)), turn


def reconstruct_from(
    starts: list[Start],
    settings: ReconstructionSettings,
    seed: int = 0,
    told: Told | None = None,
    checkpoint: Checkpoint | None = None,
) -> tuple[NeuralShape, Quaternion]:
    """As `reconstruct_standing`, from given starts, one of which a few iterations choose; of parts, those
    that the target shows."""
    starts = [replace(s, shape=replace(s.shape, present=torch.ones_like(s.shape.present))) for s in starts]
    found = _scouted(starts, settings, seed, told, checkpoint)
    shape = replace(found.shape, present=_filling(found.shape, found.target))
    return _of_needed(shape, found.target, settings, seed, checkpoint), found.turn


def _of_needed(
    shape: NeuralShape,
    target: Target,
    settings: ReconstructionSettings,
    seed: int,
    checkpoint: Checkpoint | None,
) -> NeuralShape:
    """Without the parts that the target has not. Where there were such, those that are left go on, to what
    these had kept them from, as in the second half of all iterations. What is none of the family stays as it
    was found: how oddly all its parts lie is what it is told by."""
    half, decay = settings.iterations // 2, settings.decay
    again = replace(
        settings, iterations=half, decay=1.0, rate=decay * settings.rate, pose_rate=decay * settings.pose_rate
    )
    while not torch.equal(present := needed(shape, target), shape.present):
        if familiarity(shape, target).odd:
            break
        fewer, posed = replace(shape, present=present), poses_move(shape.model, settings)
        shape, _ = optimised(fewer, target, again, seed, None, checkpoint, posed)
        shape = replace(shape, present=_filling(shape, target))
    return shape


@torch.no_grad()
def _filling(shape: NeuralShape, target: Target) -> Tensor:
    """(P,) parts that fill at least `LEAST` of the target's inside: what is less is a crumb of a part that
    should not be there (section 5)."""
    inside = target.points[target.sdf <= 0]
    if not len(inside):
        return shape.present
    owner = shape.present.nonzero().squeeze(1)[shape.part_distances(inside.numpy()).argmin(axis=0)]
    share = torch.bincount(owner, minlength=len(shape.present)) / len(inside)
    return share >= LEAST


def _found_by_part(
    start: NeuralShape,
    target: Target,
    settings: ReconstructionSettings,
    seed: int,
    told: Told | None,
    checkpoint: Checkpoint,
) -> NeuralShape:
    """Of known parts, each begins with that one of a few closest training shapes' which a few iterations
    bring closest."""
    model = start.model
    latents = latents_by_part(model, start.poses, target, min(settings.starts, _KNOWN))
    starts = [Start(replace(start, latents=one), NO_ROTATION, target) for one in latents]
    rounds = [_Round(len(starts), _share(settings, _SCOUTED))] if len(starts) > 1 else []
    scouts = _Scouts(rounds, settings, seed, told, checkpoint)
    tried = [one.shape for one in scouts.sent(starts)]
    poses = PoseTensors(*(torch.stack(each) for each in zip(*(one.poses for one in tried), strict=True)))
    found = torch.stack([one.latents for one in tried])
    best = errors_by_part(model, found, poses, target).argmin(dim=0), torch.arange(len(model.parts))
    start = replace(start, latents=found[best], poses=poses.map(lambda t: t[best]))
    return start if scouts.stopped else scouts.followed(Start(start, NO_ROTATION, target)).shape


def _scouted(
    starts: list[Start],
    settings: ReconstructionSettings,
    seed: int = 0,
    told: Told | None = None,
    checkpoint: Checkpoint | None = None,
) -> Start:
    """From the start that a few iterations bring closest: one that is close as it is may be a dead end, as a
    tube with flanges is for one without. Of many, a few iterations less tell which come into question. Then
    single parts are exchanged, and all are optimised."""
    brief, scouted = _share(settings, _BRIEF), _share(settings, _SCOUTED)
    # What an encoder saw goes a little of the way by itself, too: its poses are near, its forms are not yet.
    alone = len(starts) == 1 and not starts[0].encoded
    if not settings.iterations or alone:
        rounds = []
    elif len(starts) <= _LIKELY:
        rounds = [_Round(len(starts), scouted)]
    else:
        rounds = [_Round(len(starts), brief), _Round(_LIKELY, max(1, scouted - brief))]
    scouts = _Scouts(rounds, settings, seed, told, checkpoint)
    while scouts.rounds and not scouts.stopped:
        starts = _closest(scouts.sent(starts), scouts.rounds[0].starts if scouts.rounds else 1)
    best = _closest(starts)[0]
    if scouts.stopped:
        return best
    if settings.exchange and settings.iterations:
        best = replace(best, shape=exchanged_parts(best.shape, best.target, seed))
    return scouts.followed(best)


class _Round(NamedTuple):
    """So many starts, each given so many iterations."""

    starts: int
    iterations: int


def _share(settings: ReconstructionSettings, part: int) -> int:
    return max(1, settings.iterations // part)


class _Scouts:
    """Goes a few iterations from each start, in rounds, and then all of them from one; tells of these as of
    one way."""

    def __init__(
        self,
        rounds: list[_Round],
        settings: ReconstructionSettings,
        seed: int,
        told: Told | None,
        checkpoint: Checkpoint | None,
    ) -> None:
        self.rounds = rounds
        """That are still to come."""
        self.settings, self.seed, self.told, self.checkpoint = settings, seed, told, checkpoint
        self.stopped = False
        """Whether it was cancelled on the way."""
        self._done, self._of = 0, sum(r.starts * r.iterations for r in rounds) + settings.iterations

    def sent(self, starts: list[Start]) -> list[Start]:
        """As they come back from the next round; fewer once cancelled; as they are where none is to come."""
        if not self.rounds:
            return starts
        few = replace(self.settings, iterations=self.rounds.pop(0).iterations, decay=1.0)
        back: list[Start] = []
        for start in starts:
            shape, finished = self._go(start, few)
            back.append(replace(start, shape=shape))
            if not finished:
                self.stopped = True
                break
        return back

    def followed(self, start: Start) -> Start:
        return replace(start, shape=self._go(start, self.settings)[0])

    def _go(self, start: Start, settings: ReconstructionSettings) -> tuple[NeuralShape, bool]:
        done = self._done

        def ahead(step: Step) -> None:
            if self.told:
                self.told(step._replace(number=done + step.number, of=self._of, turn=start.turn))

        self._done += settings.iterations
        poses = poses_move(start.shape.model, settings)
        return optimised(start.shape, start.target, settings, self.seed, ahead, self.checkpoint, poses)


def _closest(starts: list[Start], count: int = 1) -> list[Start]:
    """The `count` closest ones, the closest first."""
    if len(starts) == 1:
        return starts
    return sorted(starts, key=lambda one: mean_error(one.shape, one.target))[:count]


@torch.no_grad()
def mean_error(shape: NeuralShape, target: Target, count: int = 8192) -> float:
    """Mean error of the whole shape's distance, at `count` of the target's samples."""
    rows = torch.linspace(0, len(target.sdf) - 1, min(count, len(target.sdf))).long()
    whole = torch.from_numpy(shape.distances(target.points[rows].numpy()))
    return float(target.error(whole, rows, shape.model.config.losses).mean())
