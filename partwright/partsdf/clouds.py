"""Clouds of points that an encoder learns from: the training shapes' surfaces, and what scans make of them.

Each cloud is drawn anew. Parts may come from other training shapes, each placed in the pose of the one that
it stands in for; the whole is tilted a little, covered unevenly, cut in half, and blurred. Whatever is left
is brought to the unit frame, as a shape that is read from a file is, and the poses with it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import FamilyError
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import quaternions
from partwright.partsdf.poses import PoseTensors, local_points, rotation_matrices
from partwright.shapes import LONGEST_SIDE
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.topology import doubled_areas

KEPT = 512  # surface points of each part
_EXCHANGED = 0.5  # of the clouds have parts of several shapes, a quarter of their parts
_TILT, _TURN = 0.05, 0.1  # radians, standard deviations
_NOISE = 0.03  # unit lengths, at most
_UNEVEN, _HALVED = 0.5, 0.3  # of the clouds


@dataclass(frozen=True)
class PartClouds:
    """Surface points of S shapes in the frames of their P parts (S, P, KEPT, 3), and the areas (S, P) that
    they cover, 0 where a part is missing or hidden."""

    points: Tensor
    area: Tensor

    def to(self, device: torch.device) -> PartClouds:
        return PartClouds(self.points.to(device), self.area.to(device))

    @classmethod
    def of(cls, family: PreparedFamily, model: Model) -> PartClouds:
        """Of the model's training shapes, in their order.

        Raises:
            FamilyError: the family lacks one of them, or was prepared without surfaces.
        """
        parts = len(model.parts)
        points = torch.zeros(len(model.shapes), parts, KEPT, 3)
        area = torch.zeros(len(model.shapes), parts)
        for s, shape in enumerate(training_shapes(family, model)):
            corners = shape.vertices.astype(np.float64)
            for p in range(parts):
                faces = shape.faces[shape.label == p].astype(np.int64)
                if not len(faces):
                    continue
                area[s, p] = float(doubled_areas(corners, faces).sum()) / 2
                sampled, _ = sample_triangles(corners, faces, KEPT, s)
                pose = model.poses.map(lambda t, s=s, p=p: t[s, p][None])
                points[s, p] = local_points(torch.from_numpy(sampled).float(), pose)[0]
        return cls(points, area)


def training_shapes(family: PreparedFamily, model: Model) -> Iterator[PreparedShape]:
    """The shapes that a model was trained on, in its order, each with its surface.

    Raises:
        FamilyError: the family lacks one of them, or was prepared without surfaces.
    """
    numbers = {entry.name: i for i, entry in enumerate(family.shapes)}
    missing = [name for name in model.shapes if name not in numbers]
    if missing or family.parts != model.parts:
        raise FamilyError(
            f"{family.folder}: is not what {model.name} was trained on: "
            + (f"{missing[0]!r} is missing" if missing else "it has other parts")
        )
    for name in model.shapes:
        shape = family.load(numbers[name])
        if not len(shape.faces):
            raise FamilyError(f"{family.folder}: was prepared without surfaces, which an encoder learns from")
        yield shape


def donors_of(model: Model, shapes: Tensor, seen: Tensor, generator: torch.Generator) -> Tensor:
    """(B, P) which training shape each part of the training shapes (B,) comes from: half of these have a
    quarter of their parts exchanged for others'. seen: (S, P) whether a part has a surface."""
    batch, parts = len(shapes), len(model.parts)
    others = torch.randint(len(model.shapes), (batch, parts), generator=generator)
    some = torch.rand(batch, 1, generator=generator) < _EXCHANGED
    exchanged = some & (torch.rand(batch, parts, generator=generator) < 0.25)
    exchanged &= model.present[shapes] & seen[others, torch.arange(parts)]
    return torch.where(exchanged, others, shapes[:, None].expand(batch, parts))


@dataclass(frozen=True)
class Drawn:
    """Clouds (B, N, 3) in the unit frame, with the latents (B, P, Z), poses (B, P, ...) and presence (B, P)
    of what was scanned."""

    points: Tensor
    latents: Tensor
    poses: PoseTensors
    present: Tensor


def draw(
    clouds: PartClouds,
    model: Model,
    shapes: Tensor,
    count: int,
    generator: torch.Generator,
    plain: bool = False,
) -> Drawn:
    """Clouds of `count` points of training shapes (B,), as scans give them; `plain`: as they are."""
    batch, parts = len(shapes), len(model.parts)

    def uniform(*size: int) -> Tensor:
        return torch.rand(*size, generator=generator)

    donors = shapes[:, None].expand(batch, parts)
    if not plain:
        donors = donors_of(model, shapes, clouds.area > 0, generator)
    number = torch.arange(parts).expand(batch, parts)
    latents, present = model.latents[donors, number], model.present[shapes]
    poses = model.poses.map(lambda t: t[shapes])
    # Which part each point is of, then which of that part's points.
    area = clouds.area[shapes] + 1e-9
    if not plain:
        area = area * torch.where(uniform(batch, 1) < _UNEVEN, 0.3 + uniform(batch, parts), 1.0)
    most = 2 * count
    of = torch.multinomial(area, most, replacement=True, generator=generator)
    row = torch.randint(KEPT, (batch, most), generator=generator)
    local = clouds.points[donors.gather(1, of), of, row]
    chosen = poses.map(lambda t: t.gather(1, of[..., None].expand(-1, -1, t.shape[-1])))
    turned = torch.einsum("bnij,bnj->bni", rotation_matrices(chosen.rotation), local * chosen.scale)
    points = turned + chosen.translation
    if plain:
        return Drawn(points[:, :count], latents, poses, present)
    points, poses = _tilted(points, poses, generator)
    points = _cut(points, count, generator)
    noise = _NOISE * uniform(batch, 1, 1) ** 3 * torch.randn(points.shape, generator=generator)
    return Drawn(*_framed(points + noise, latents, poses), present)


def unit_cloud(points: Tensor) -> Tensor:
    """Clouds (B, N, 3) centred by their bounding boxes, the longest side as in the unit frame."""
    centre, larger = _frame(points)
    return (points - centre) * larger


def _frame(points: Tensor) -> tuple[Tensor, Tensor]:
    """Of clouds (B, N, 3): the middles of their boxes (B, 1, 3), and factors (B, 1, 1) to the unit frame."""
    low, high = points.amin(dim=1, keepdim=True), points.amax(dim=1, keepdim=True)
    return (low + high) / 2, LONGEST_SIDE / (high - low).amax(dim=2, keepdim=True)


def _tilted(points: Tensor, poses: PoseTensors, generator: torch.Generator) -> tuple[Tensor, PoseTensors]:
    """Turned a little about z and less about the others."""
    angle = torch.randn(len(points), 3, generator=generator) * torch.tensor([_TILT, _TILT, _TURN])
    quaternion = torch.cat([torch.ones(len(points), 1), angle / 2], dim=1)
    matrix = rotation_matrices(quaternion)
    rotation = quaternions(matrix[:, None] @ rotation_matrices(poses.rotation))
    place = poses.translation @ matrix.transpose(1, 2)
    return points @ matrix.transpose(1, 2), PoseTensors(place, rotation, poses.scale)


def _cut(points: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """(B, count, 3) of (B, 2 count, 3): some lack what lies beyond a plane, as much as half."""
    direction = torch.nn.functional.normalize(torch.randn(len(points), 1, 3, generator=generator), dim=2)
    along = (points * direction).sum(dim=2)
    halved = torch.rand(len(points), 1, generator=generator) < _HALVED
    lost = torch.where(halved, 0.5 * torch.rand(len(points), 1, generator=generator), 0.0)
    rank = along.argsort(dim=1).argsort(dim=1) / along.shape[1]
    rank = torch.where(rank >= lost, torch.rand(rank.shape, generator=generator), 2.0)
    kept = rank.argsort(dim=1)[:, :count]
    return points.gather(1, kept[..., None].expand(-1, -1, 3))


def _framed(points: Tensor, latents: Tensor, poses: PoseTensors) -> tuple[Tensor, Tensor, PoseTensors]:
    centre, larger = _frame(points)
    placed = PoseTensors((poses.translation - centre) * larger, poses.rotation, poses.scale * larger)
    return (points - centre) * larger, latents, placed
