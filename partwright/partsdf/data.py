"""A prepared family in memory, and the points that each step draws from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import FamilyError
from partwright.partsdf.config import Config
from partwright.partsdf.poses import PoseTensors, identity

WHOLE = "whole"  # the name of the one part of "Ours-1P"


@dataclass(frozen=True)
class FamilySamples:
    """Samples of S shapes, N each, unit frame: points (S, N, 3), sdf (S, N), part (S, N) uint8 the nearest
    part. Of each shape the first `inside` (S,) lie inside. poses (S, P, ...); present (S, P) bool."""

    names: tuple[str, ...]
    points: Tensor
    sdf: Tensor
    part: Tensor
    inside: Tensor
    poses: PoseTensors
    present: Tensor

    def __len__(self) -> int:
        return len(self.names)

    def to(self, device: torch.device | str) -> FamilySamples:
        moved: dict[str, Any] = {k: v.to(device) for k, v in vars(self).items() if isinstance(v, Tensor)}
        return replace(self, **moved, poses=self.poses.map(lambda t: t.to(device)))

    def draw(self, shapes: Tensor, count: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Points (B, count, 3), sdf and part (B, count) of shapes (B,): half inside, half outside."""
        total, half = self.points.shape[1], count // 2
        chance = torch.rand(len(shapes), count, generator=generator, device=self.points.device)
        inside = self.inside[shapes][:, None]
        chosen = torch.cat([chance[:, :half] * inside, inside + chance[:, half:] * (total - inside)], dim=1)
        # float32 may round up to the end of a range.
        end = torch.where(torch.arange(count, device=chance.device) < half, inside, total)
        row = torch.minimum(chosen.long(), end - 1)
        shape = shapes[:, None]
        return self.points[shape, row], self.sdf[shape, row], self.part[shape, row]


def part_names(family: PreparedFamily, config: Config) -> tuple[str, ...]:
    return (WHOLE,) if config.one_part else family.parts


def load_samples(family: PreparedFamily, indices: list[int], config: Config) -> FamilySamples:
    """The samples of some shapes of a family, as the configuration wants them.

    Raises:
        FamilyError: a shape has no sample inside or none outside, or shapes differ in their samples.
    """
    shapes = [family.load(i) for i in indices]
    rows = [_rows(shape, config) for shape in shapes]
    if len({len(row) for row in rows}) > 1:
        raise FamilyError(
            f"{family.folder}: shapes have different numbers of samples; prepare the family again with one, "
            "or set training.samples to the smallest"
        )
    found = list(zip(shapes, rows, strict=True))
    poses = [pose_tensors(shape, config) for shape in shapes]
    return FamilySamples(
        names=tuple(shape.name for shape in shapes),
        points=torch.stack([torch.from_numpy(shape.points[row]) for shape, row in found]),
        sdf=torch.stack([torch.from_numpy(shape.sdf[row]) for shape, row in found]),
        part=torch.stack([_labels(shape, row, config) for shape, row in found]),
        inside=torch.tensor([int((shape.sdf[row] < 0).sum()) for shape, row in found]),
        poses=PoseTensors(*(torch.stack(ts) for ts in zip(*poses, strict=True))),
        present=torch.stack([present_parts(shape, config) for shape in shapes]),
    )


def pose_tensors(shape: PreparedShape, config: Config) -> PoseTensors:
    """Poses (P, ...) of a shape's parts; all the identity where the model knows no poses or no parts."""
    if config.one_part or not config.poses:
        return identity(1 if config.one_part else len(shape.present))
    return PoseTensors.of(shape.poses)


def present_parts(shape: PreparedShape, config: Config) -> Tensor:
    """(P,) bool."""
    present = shape.present.astype(bool)
    return torch.from_numpy(present.any(keepdims=True) if config.one_part else present)


def check_training_shapes(family: PreparedFamily, samples: FamilySamples, config: Config) -> None:
    """Raise FamilyError unless there are two shapes or more, and each part is in one of them."""
    if len(samples) < 2:
        raise FamilyError(
            f"{family.folder}: {len(samples)} shapes to train on; a prior over shapes needs two or more"
        )
    for name, shown in zip(part_names(family, config), samples.present.any(dim=0).tolist(), strict=True):
        if not shown:
            raise FamilyError(
                f"{family.folder}: none of the {len(samples)} training shapes has the part {name!r}; "
                "add shapes that have it, or prepare the family without it"
            )


def _rows(shape: PreparedShape, config: Config) -> np.ndarray:
    """Rows of the samples that are kept, those inside first."""
    inside = int((shape.sdf < 0).sum())
    if inside in (0, len(shape.sdf)):
        where = "inside" if inside == 0 else "outside"
        raise FamilyError(f"{shape.name}: no sample lies {where} the shape; prepare it with more samples")
    kept = np.arange(len(shape.sdf))
    wanted = config.training.samples
    if 0 < wanted < len(kept):
        kept = np.random.default_rng(config.training.seed).permutation(len(kept))[:wanted]
        kept.sort()
    return kept[np.argsort(shape.sdf[kept] >= 0, kind="stable")]


def _labels(shape: PreparedShape, row: np.ndarray, config: Config) -> Tensor:
    part = np.zeros(len(row), np.uint8) if config.one_part else shape.part[row].astype(np.uint8)
    return torch.from_numpy(part)
