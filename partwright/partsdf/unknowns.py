"""What a reconstruction moves: latents and poses as they are, or in the spread that the family has them in.

Of known parts every number moves by itself, as the paper has it. Where parts are unknown, numbers move along
the principal directions of the training shapes', each in its spread: that takes a quarter of the steps, as
what varies most moves most. And where points are all that is known, which leave open what noise and what is
not seen hide, they are drawn to what is likely in the family: to the most likely shape, given the points, if
errors of these are Laplacian and the family's numbers normal, all parts' together: where one leg ends tells
where the next one does.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import torch
from torch import Tensor

from partwright.partsdf.losses import latent_penalty
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import MOST, RIDGE, PartVectors, covariance
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target

# Steps in the family's spread, over those of the numbers themselves.
_LATENTS_FASTER, _POSES_FASTER = 10.0, 25.0
_FRAME_FASTER = 2.5  # of a frame's place and the logarithm of its size, over poses


class Unknowns(Protocol):
    """Latents (P, Z) and poses (P, ...) that an optimiser moves."""

    def groups(self, settings: ReconstructionSettings) -> list[dict[str, Any]]:
        """For an optimiser: which tensors, each at its rate."""

    def latents(self) -> Tensor: ...

    def poses(self) -> PoseTensors:
        """With rotations of any length."""

    def prior(self, off: float, moved: bool) -> Tensor:
        """The loss of how unlikely they are. off: the mean error at points that are known to be on the
        surface. moved: whether poses are among what moves by now."""


class Frame(NamedTuple):
    """Where the family's unit frame lies in another one: its middle (3,), and the logarithm of its size."""

    place: Tensor
    size: Tensor

    @classmethod
    def identity(cls) -> Frame:
        return cls(torch.zeros(3), torch.zeros(()))

    @classmethod
    def of(cls, vectors: PartVectors, poses: PoseTensors) -> Frame:
        """In which poses (P, ...) lie as is usual: as large as the family's parts, then where these are."""
        size = _mean(poses.scale.log() - vectors.pose_mean[:, 9:], vectors.pose_spread[:, 9:], (0, 1))
        middle, spread = size.exp() * vectors.pose_mean[:, :3], vectors.pose_spread[:, :3]
        return cls(_mean(poses.translation - middle, spread, (0,)), size)

    def from_family(self, poses: PoseTensors) -> PoseTensors:
        """Poses (..., P, ...) of the family's frame, in the other one."""
        larger = self.size.exp()
        return PoseTensors(larger * poses.translation + self.place, poses.rotation, larger * poses.scale)

    def to_family(self, poses: PoseTensors) -> PoseTensors:
        """Poses (..., P, ...) of the other frame, in the family's."""
        smaller = (-self.size).exp()
        return PoseTensors(smaller * (poses.translation - self.place), poses.rotation, smaller * poses.scale)


def _mean(values: Tensor, spread: Tensor, over: tuple[int, ...]) -> Tensor:
    weight = spread**-2
    return (weight * values).sum(dim=over) / weight.sum(dim=over)


class FreeUnknowns:
    """Every number by itself; half-lengths by their logarithm: they stay positive, and long and short sides
    alike. moving: (P,) bool, parts that move; all if None."""

    def __init__(self, start: NeuralShape, move_poses: bool, moving: Tensor | None = None) -> None:
        self._start, self._move_poses = start, move_poses
        moving = torch.ones_like(start.present) if moving is None else moving
        self._held = (~moving)[:, None]
        self._latents = start.latents.clone().requires_grad_()
        self._placed = start.poses.map(lambda t: t.clone().requires_grad_(move_poses))
        self._size = start.poses.scale.log().requires_grad_(move_poses)

    def groups(self, settings: ReconstructionSettings) -> list[dict[str, Any]]:
        groups: list[dict[str, Any]] = [{"params": [self._latents], "lr": settings.rate}]
        if self._move_poses:
            placed = [self._placed.translation, self._placed.rotation, self._size]
            groups.append({"params": placed, "lr": settings.pose_rate})
        return groups

    def latents(self) -> Tensor:
        return torch.where(self._held, self._start.latents, self._latents)

    def poses(self) -> PoseTensors:
        if not self._move_poses:
            return self._start.poses
        placed = self._placed._replace(scale=self._size.exp())
        pairs = zip(self._start.poses, placed, strict=True)
        return PoseTensors(*(torch.where(self._held, still, moved) for still, moved in pairs))

    def prior(self, off: float, moved: bool) -> Tensor:
        losses = self._start.model.config.losses
        return latent_penalty(self._latents, losses, losses.ramp)


class FamilyUnknowns:
    """Along the family's principal directions, each in its spread there; what a start has beside these stays.
    Where points are all that is known, they may be of a piece of the shape, so its frame moves, too.

    count: of the points that are known, each with an error of its own; 0 where a surface is, which leaves
    nothing open.
    """

    def __init__(self, start: NeuralShape, move_poses: bool, count: int) -> None:
        self._start, self._move_poses, self._count = start, move_poses, count
        self._vectors = PartVectors.of(start.model)
        self._form = self._vectors.of_latents(start.latents).requires_grad_()
        self._frame = Frame.of(self._vectors, start.poses) if count else Frame.identity()
        self._moves_frame = move_poses and count > 0
        for tensor in self._frame:
            tensor.requires_grad_(self._moves_frame)
        placed = Frame(*(t.detach() for t in self._frame)).to_family(start.poses)
        self._place = self._vectors.of_poses(placed).requires_grad_(move_poses)
        self._precision = precision(start.model, self._vectors) if count else None
        self._beside = start.latents - self._vectors.latents(self._form.detach())

    def groups(self, settings: ReconstructionSettings) -> list[dict[str, Any]]:
        groups: list[dict[str, Any]] = [{"params": [self._form], "lr": _LATENTS_FASTER * settings.rate}]
        if self._move_poses:
            groups.append({"params": [self._place], "lr": _POSES_FASTER * settings.pose_rate})
        if self._moves_frame:
            groups.append({"params": list(self._frame), "lr": _FRAME_FASTER * settings.pose_rate})
        return groups

    def latents(self) -> Tensor:
        return self._vectors.latents(self._form) + self._beside

    def poses(self) -> PoseTensors:
        if not self._move_poses:
            return self._start.poses
        placed = self._vectors.poses(self._place)
        return self._frame.from_family(placed) if self._moves_frame else placed

    def prior(self, off: float, moved: bool) -> Tensor:
        if self._precision is None:
            return torch.zeros(())
        numbers = _together(self._place if moved else self._place.detach(), self._form)
        # Of sum |d| / off + unlikely / 2, what is minimised is the mean of the first.
        return torch.as_tensor(0.5 * off / self._count) * (numbers @ self._precision @ numbers)


def precision(model: Model, vectors: PartVectors) -> Tensor:
    """(D, D) of all numbers of a shape, D = P (12 + K), each in its spread, as normal ones with the training
    shapes' covariance; a part that is not there has the mean's. With a ridge, after which each number by
    itself has a variance of 1 still."""
    there = model.present[..., None].double()
    known = _together(vectors.of_poses(model.poses) * there, vectors.of_latents(model.latents) * there)
    return torch.linalg.inv(covariance(known) / (1 + RIDGE)).float()


def _together(place: Tensor, form: Tensor) -> Tensor:
    """(..., P (12 + K)) of (..., P, 12) and (..., P, K)."""
    return torch.cat([place, form], dim=-1).flatten(-2)


def unknowns_of(start: NeuralShape, move_poses: bool, target: Target) -> Unknowns:
    """The family's, where parts are unknown and there are training shapes enough for all its directions."""
    model = start.model
    enough = len(model.shapes) > min(MOST, model.latents.shape[2]) and bool(model.present.any(dim=0).all())
    if target.part is not None or not enough:
        return FreeUnknowns(start, move_poses)
    return FamilyUnknowns(start, move_poses, target.count)
