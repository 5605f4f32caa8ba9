"""Parts that lie in the surface of others, as windows in a body: which stand out of it, and put back into it.

How far from the others' surface a part's own goes is known from training shapes: of a window a hundredth of a
unit length, of a wheel much more. A part that never goes far lies in them. Where a new one does, as a window
above a roof that is too low for it, latents and poses of all such parts move together until their surfaces
are as near to the others as is usual.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import torch
from torch import Tensor

from partwright.partsdf.cores import one_core_each
from partwright.partsdf.decoded import Decoded
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.offsets import beyond_range
from partwright.partsdf.poses import PoseTensors, local_points, rotation_matrices
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.unknowns import FamilyUnknowns

if TYPE_CHECKING:
    import trimesh

STANDS_OUT = 0.05  # of the surface of a part that lies in others
_MOST = 0.98  # of a part's surface, that is within its limit in training shapes
_NEAR = 0.05  # unit lengths: a part that goes farther in a training shape does not lie in others
_SLACK = 0.005  # unit lengths beyond that
_STEPS, _PLACES = 60, 300  # places a part
_LEFT = 0.005  # of the places, that may stand out in the end
_HOLD = 1e-3  # weight of the squared way, each number in its spread, against unit lengths
_ODD = 0.01  # unit lengths beyond the training shapes' range that parts may lie to others in the end
_ORDER = 0.05  # weight of that
_LEAP = 0.05  # unit lengths that a place may follow the surface in a step
_RATES = ReconstructionSettings(rate=3e-3, pose_rate=1.2e-3)


class Reach(NamedTuple):
    """How far from the others a part's surface goes in training shapes, unit lengths: usually and at most."""

    usual: float
    most: float


@dataclass(frozen=True)
class Inset:
    """A part that lies in others. reach: of training shapes; share: of its mesh's vertices, farther than any;
    points (K, 3): of its surface, unit frame."""

    part: str
    reach: Reach
    share: float
    points: np.ndarray

    @property
    def stands_out(self) -> bool:
        return self.share > STANDS_OUT

    @property
    def limit(self) -> float:
        """To be kept to when parts are put back: one that stands out is to lie as is usual."""
        return self.reach.usual if self.stands_out else self.reach.most


def reaches(trained: Iterable[Mapping[str, np.ndarray]]) -> dict[str, Reach]:
    """Of the parts that lie in others in all training shapes, by name. trained: of each of these, how far the
    vertices of its parts' meshes are from the other parts."""
    found: dict[str, list[float]] = {}
    for off in trained:
        for name, far in off.items() if len(off) > 1 else ():
            found.setdefault(name, []).append(float(np.quantile(far, _MOST)))
    return {
        name: Reach(float(np.median(far)) + _SLACK, max(far) + _SLACK)
        for name, far in found.items()
        if max(far) < _NEAR
    }


def insets(
    parts: dict[str, trimesh.Trimesh], known: Mapping[str, Reach], off: Mapping[str, np.ndarray]
) -> tuple[Inset, ...]:
    """The parts that are known to lie in others, by the parts' own meshes (unit frame); off: how far the
    vertices of each are from the other parts."""
    rng = np.random.default_rng(0)
    found = []
    for name, far in off.items() if len(off) > 1 else ():
        if name not in known:
            continue
        points = rng.permutation(np.asarray(parts[name].vertices, np.float32))[:_PLACES]
        share = float((far > known[name].most).mean())
        found.append(Inset(name, known[name], share, points))
    return tuple(found)


@one_core_each()
def put_back(
    shape: NeuralShape, found: Iterable[Inset], keep: Collection[str] = (), move_pose: bool = True
) -> NeuralShape:
    """The shape with latents and poses of the insets moved along the family's directions, all together, until
    what stands out is within the limits; other parts, and those of `keep`, stay as they are. move_pose: else,
    and of models without poses, latents alone move."""
    moving = [one for one in found if one.part not in keep]
    if not moving:
        return shape
    model = shape.model
    unknowns = FamilyUnknowns(shape, move_pose and model.config.poses, 0)
    optimiser = torch.optim.Adam(unknowns.groups(_RATES))
    counts = [len(one.points) for one in moving]
    numbers = torch.tensor([model.index(one.part) for one in moving])
    owner = torch.repeat_interleave(numbers, torch.tensor(counts))
    limit = torch.repeat_interleave(torch.tensor([one.limit for one in moving]), torch.tensor(counts))
    surface = _Carried(shape, owner, torch.from_numpy(np.concatenate([one.points for one in moving])))
    row = torch.zeros(len(shape.present), 1, dtype=torch.bool)
    row[numbers] = True

    def now() -> tuple[Tensor, PoseTensors]:
        placed = (torch.where(row, a, b) for a, b in zip(unknowns.poses(), shape.poses, strict=True))
        return torch.where(row, unknowns.latents(), shape.latents), PoseTensors(*placed)

    moved = [tensor for group in optimiser.param_groups for tensor in group["params"]]
    begun = [tensor.detach().clone() for tensor in moved]
    for _ in range(_STEPS):
        latents, poses = now()
        out = torch.relu(surface.from_others(latents, poses) - limit)
        odd = torch.relu(beyond_range(model, poses, shape.present)[0]).sum()
        if (out > 0).float().mean() < _LEFT and odd < _ODD:
            break
        far = sum(((a - b) ** 2).mean() for a, b in zip(moved, begun, strict=True))
        optimiser.zero_grad()
        (out.mean() + _ORDER * odd + _HOLD * far).backward()
        optimiser.step()
    latents, poses = now()
    return replace(shape, latents=latents.detach(), poses=poses.map(Tensor.detach))


class _Carried:
    """Places (M, 3) of parts' surfaces, which they follow as poses and latents change. owner (M,): whose;
    those of a part stand together."""

    def __init__(self, shape: NeuralShape, owner: Tensor, places: Tensor) -> None:
        self._model, self._owner = shape.model, owner
        self._parts, self._counts = (t.tolist() for t in owner.unique_consecutive(return_counts=True))
        self._hidden = ~shape.present[:, None]
        self._local = local_points(places, shape.poses)[owner, torch.arange(len(owner))]
        there = places.clone().requires_grad_()
        own = self._own(self._model.decoded(shape.latents, shape.poses), there)
        (slope,) = torch.autograd.grad(own.sum(), there)
        self._normal = torch.nn.functional.normalize(slope, dim=1)

    def from_others(self, latents: Tensor, poses: PoseTensors) -> Tensor:
        """(M,) distances from the other parts that are there."""
        turn, size, place = rotation_matrices(poses.rotation), poses.scale, poses.translation
        moved = (turn[self._owner] @ (self._local * size[self._owner])[..., None]).squeeze(-1)
        moved = moved + place[self._owner]
        shape = self._model.decoded(latents, poses)
        # A step of Newton's along the normal: the surface moves with the latent, too.
        off = self._own(shape, moved).clamp(-_LEAP, _LEAP)
        distance = shape.parts(moved - off[:, None] * self._normal)
        distance = distance.masked_fill(self._hidden, torch.inf)
        distance = distance.scatter(0, self._owner[None], torch.inf)
        return distance.amin(dim=0)

    def _own(self, shape: Decoded, places: Tensor) -> Tensor:
        groups = places.split(self._counts)
        return torch.cat([shape.part(i, some) for i, some in zip(self._parts, groups, strict=True)])
