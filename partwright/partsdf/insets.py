"""Parts that lie in the surface of others, as windows in a body: which stand out of it or are covered by it,
and put back where they belong.

How far from the others' surface a part's own goes is known from training shapes: of a window a hundredth of a
unit length, of a wheel much more. A part that never goes far lies in them. Where a new one does, as a window
above a roof that is too low for it, latents and poses of all such parts move together until their surfaces
are as near to the others as is usual. How much of a part's surface shows is known, too, and in which cells of
its box: one that shows less than half of the least, as a windscreen under a roof, moves until it does there.
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
COVERED = 0.5  # of the least share of a part's surface that shows in training shapes: what shows less
_SHOWS, _CLEAR = -0.003, 0.002  # unit lengths from the others, of what shows, and of what is moved to show
_CELLS = 3  # along each side of a part's box
_MOST = 0.98  # of a part's surface, that is within its limit in training shapes
_NEAR = 0.05  # unit lengths: a part that goes farther in a training shape does not lie in others
_SLACK = 0.005  # unit lengths beyond that
_STEPS, _PLACES = 60, 300  # places a part
_LEFT = 0.005  # of the places, that may stand out or be covered in the end
_HOLD = 1e-3  # weight of the squared way, each number in its spread, against unit lengths
_ODD = 0.01  # unit lengths beyond the training shapes' range that parts may lie to others in the end
_ORDER = 0.05  # weight of that
_LEAP = 0.05  # unit lengths that a place may follow the surface in a step
_RATES = ReconstructionSettings(rate=3e-3, pose_rate=1.2e-3)


class Reach(NamedTuple):
    """How far from the others a part's surface goes in training shapes, unit lengths: usually and at most,
    infinite of one that does not lie in them; the least share of it that shows; and in which of the cells
    (27,) of its box it mostly does."""

    usual: float
    most: float
    shown: float
    cells: np.ndarray

    @property
    def lies_in(self) -> bool:
        return self.most < np.inf


@dataclass(frozen=True)
class Inset:
    """A part among others. reach: of training shapes; of its mesh's vertices, share: farther than any, shown:
    not in other parts; points (K, 3): of its surface, unit frame; shows (K,): where it usually does."""

    part: str
    reach: Reach
    share: float
    shown: float
    points: np.ndarray
    shows: np.ndarray

    @property
    def stands_out(self) -> bool:
        return self.share > STANDS_OUT

    @property
    def covered(self) -> bool:
        return self.shown < COVERED * self.reach.shown

    @property
    def amiss(self) -> float:
        """How much of it is not where it belongs, from 0 to 1."""
        hidden = 1 - self.shown / self.reach.shown if self.covered else 0.0
        return max(hidden, self.share if self.stands_out else 0.0)

    @property
    def limit(self) -> float:
        """To be kept to when parts are put back: one that stands out or is covered is to lie as is usual."""
        return self.reach.usual if self.stands_out or self.covered else self.reach.most


def reaches(
    trained: Iterable[tuple[NeuralShape, Mapping[str, trimesh.Trimesh], Mapping[str, np.ndarray]]],
) -> dict[str, Reach]:
    """Of parts in training shapes, by name. trained: these, the meshes of their parts (unit frame), and how
    far the vertices of each are from the other parts."""
    found: dict[str, list[tuple[float, float]]] = {}
    cells: dict[str, np.ndarray] = {}  # (2, 27) vertices that show, and all
    for shape, parts, off in trained:
        for name, far in off.items() if len(off) > 1 else ():
            shows = far > _SHOWS
            found.setdefault(name, []).append((float(np.quantile(far, _MOST)), float(shows.mean())))
            cell = _cells(shape, name, parts[name].vertices)
            count = [np.bincount(some, minlength=_CELLS**3) for some in (cell[shows], cell)]
            cells[name] = cells.get(name, 0) + np.stack(count)
    known = {}
    for name, each in found.items():
        far, shown = np.transpose(each)
        beyond = _SLACK if far.max() < _NEAR else np.inf
        mostly = 2 * cells[name][0] > cells[name][1]
        known[name] = Reach(float(np.median(far)) + beyond, float(far.max()) + beyond, shown.min(), mostly)
    return known


def insets(
    shape: NeuralShape,
    parts: Mapping[str, trimesh.Trimesh],
    known: Mapping[str, Reach],
    off: Mapping[str, np.ndarray],
) -> tuple[Inset, ...]:
    """Of all parts that are known; parts and off as of `reaches`."""
    rng = np.random.default_rng(0)
    found = []
    for name, far in off.items() if len(off) > 1 else ():
        if name not in known:
            continue
        reach = known[name]
        points = rng.permutation(np.asarray(parts[name].vertices, np.float32))[:_PLACES]
        share, shown = float((far > reach.most).mean()), float((far > _SHOWS).mean())
        found.append(Inset(name, reach, share, shown, points, reach.cells[_cells(shape, name, points)]))
    return tuple(found)


def _cells(shape: NeuralShape, name: str, points: np.ndarray) -> np.ndarray:
    """(N,) numbers of the cells of a part's box that points (N, 3) of the unit frame are in or next to."""
    cells = np.floor((shape.in_box(name, points) + 1) / 2 * _CELLS).clip(0, _CELLS - 1)
    return np.asarray(cells.astype(int) @ _CELLS ** np.arange(2, -1, -1))


@one_core_each()
def put_back(
    shape: NeuralShape, found: Iterable[Inset], keep: Collection[str] = (), move_pose: bool = True
) -> NeuralShape:
    """The shape with latents and poses of parts that lie in others, or are covered, moved along the family's
    directions, all together, until what stands out is within the limits and what is covered shows; other
    parts, and those of `keep`, stay as they are. move_pose: else, and of models without poses, latents alone
    move."""
    moving = [one for one in found if (one.reach.lies_in or one.covered) and one.part not in keep]
    if not moving:
        return shape
    model = shape.model
    unknowns = FamilyUnknowns(shape, move_pose and model.config.poses, 0)
    optimiser = torch.optim.Adam(unknowns.groups(_RATES))
    counts = [len(one.points) for one in moving]
    numbers = torch.tensor([model.index(one.part) for one in moving])
    owner = torch.repeat_interleave(numbers, torch.tensor(counts))
    limit = torch.repeat_interleave(torch.tensor([one.limit for one in moving]), torch.tensor(counts))
    shows = torch.from_numpy(np.concatenate([one.shows & one.covered for one in moving]))
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
        off = surface.from_others(latents, poses)
        wrong = torch.relu(off - limit) + torch.relu(_CLEAR - off) * shows
        odd = torch.relu(beyond_range(model, poses, shape.present)[0]).sum()
        if (wrong > 0).float().mean() < _LEFT and odd < _ODD:
            break
        far = sum(((a - b) ** 2).mean() for a, b in zip(moved, begun, strict=True))
        optimiser.zero_grad()
        (wrong.mean() + _ORDER * odd + _HOLD * far).backward()
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
