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
from partwright.partsdf.poses import PoseTensors, identity, local_points
from partwright.shapes.cleaning import counted

WHOLE = "whole"  # the name of the one part of "Ours-1P"


@dataclass(frozen=True)
class FamilySamples:
    """Samples of S shapes, N each, unit frame: points (S, N, 3), sdf (S, N), part (S, N) uint8 the nearest
    part. Of each shape the first `inside` (S,) lie inside; both sides are sorted by part, and `ends`
    (S, 2 P + 1) says where each part's begin, first those inside. poses (S, P, ...); present (S, P) bool."""

    names: tuple[str, ...]
    points: Tensor
    sdf: Tensor
    part: Tensor
    inside: Tensor
    ends: Tensor
    poses: PoseTensors
    present: Tensor

    def __len__(self) -> int:
        return len(self.names)

    def to(self, device: torch.device | str) -> FamilySamples:
        moved: dict[str, Any] = {k: v.to(device) for k, v in vars(self).items() if isinstance(v, Tensor)}
        return replace(self, **moved, poses=self.poses.map(lambda t: t.to(device)))

    def draw(
        self, shapes: Tensor, count: int, generator: torch.Generator, balance: float = 0.0
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Points (B, count, 3), sdf and part (B, count) of shapes (B,): half inside, half outside.

        balance: the share of either half that all parts of a shape share alike, however small they are.
        """
        half, device = count // 2, self.points.device
        chance = torch.rand(len(shapes), count, generator=generator, device=device)
        side = (torch.arange(count, device=device) >= half).long()  # 0 inside, 1 outside
        ends = self.ends[shapes]  # (B, 2 P + 1)
        parts = self.present.shape[1]
        low, high = ends[:, side * parts], ends[:, side * parts + parts]
        fair = round(balance * half)
        if fair:
            some = torch.cat([torch.arange(fair, device=device), half + torch.arange(fair, device=device)])
            low[:, some], high[:, some] = self._of_one_part(ends, side[some], generator)
        # float32 may round up to the end of a range.
        row = torch.minimum(low + (chance * (high - low)).long(), high - 1)
        shape = shapes[:, None]
        return self.points[shape, row], self.sdf[shape, row], self.part[shape, row]

    def _of_one_part(self, ends: Tensor, side: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Where the samples of a part begin and end (B, C), of one drawn for each of the sides (C,), of those
        parts that have any there."""
        parts, counts = self.present.shape[1], ends.diff(dim=1)
        any_there = (counts > 0).float().unflatten(1, (2, parts))[:, side]  # (B, C, P)
        drawn = torch.multinomial(any_there.flatten(0, 1), 1, generator=generator).view(len(ends), -1)
        place = side * parts + drawn
        return ends.gather(1, place), ends.gather(1, place + 1)


def needed_room(samples: FamilySamples) -> Tensor:
    """(P, 3) how far samples inside lie along the axes of their parts, in half-lengths of its cuboid."""
    needed = torch.zeros(samples.present.shape[1], 3)
    for i, inside in enumerate(samples.inside.tolist()):
        local = local_points(samples.points[i, :inside], samples.poses.map(lambda t, i=i: t[i])).abs()
        for p, owner in enumerate(samples.part[i, :inside] == torch.arange(len(needed))[:, None]):
            if owner.any():
                needed[p] = torch.maximum(needed[p], local[p, owner].amax(dim=0))
    return needed


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
        ends=torch.stack([_ends(shape, row, config) for shape, row in found]),
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
            f"{family.folder}: {counted(len(samples), 'shape')} to train on; a prior over shapes needs two "
            "or more"
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
    part = np.zeros(len(kept)) if config.one_part else shape.part[kept]
    return kept[np.lexsort((part, shape.sdf[kept] >= 0))]


def _ends(shape: PreparedShape, row: np.ndarray, config: Config) -> Tensor:
    """(2 P + 1,) where the samples of each part begin, first those inside, in the order of `row`."""
    parts = 1 if config.one_part else len(shape.present)
    part = np.zeros(len(row), np.int64) if config.one_part else shape.part[row].astype(np.int64)
    counts = np.bincount(part + parts * (shape.sdf[row] >= 0), minlength=2 * parts)
    return torch.from_numpy(np.concatenate([[0], np.cumsum(counts)]))


def _labels(shape: PreparedShape, row: np.ndarray, config: Config) -> Tensor:
    part = np.zeros(len(row), np.uint8) if config.one_part else shape.part[row].astype(np.uint8)
    return torch.from_numpy(part)
