"""A shape as its model knows it: latents and poses of all parts, in the unit frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from partwright.assembly.similarity import Similarity
from partwright.errors import SettingError
from partwright.partsdf.cores import one_core_each
from partwright.partsdf.decoded import Decoded
from partwright.partsdf.losses import aggregate
from partwright.partsdf.model import Model
from partwright.partsdf.poses import PoseTensors, local_points

_WALL_PLACES, _CUBOID_MARGIN = 1000, 1.05  # where walls are looked for, in and around a part's cuboid
_WALL_QUANTILE = 0.95  # of the depths inside, which is half a wall
# Times the median depth. A convex body's quantile is at most 3.06 times, as a ball's (Brunn, Minkowski).
_UNEVEN = 3.3
# Pairs of point and part that are decoded at once, so that they stay in the cache: by the compiled kernel,
# and by PyTorch, which takes them layer by layer.
CHUNK, _CHUNK_OF_LAYERS = 1 << 13, 1 << 11


@dataclass(frozen=True)
class NeuralShape:
    """latents (P, Z), poses (P, ...), present (P,) bool: parts that are absent take no part in the minimum,
    but the others were trained beside their latent and pose."""

    model: Model
    latents: Tensor
    poses: PoseTensors
    present: Tensor

    @classmethod
    def mean(cls, model: Model, present: Tensor | None = None) -> NeuralShape:
        """Mean latents and average poses; absent parts as the model knows them."""
        there = torch.ones(len(model.parts), dtype=torch.bool) if present is None else present
        latents = torch.where(there[:, None], model.mean_latent, model.absent_latent)
        return cls(model, latents, model.average_pose, there)

    @classmethod
    def of(cls, model: Model, latents: Tensor, poses: PoseTensors, present: Tensor) -> NeuralShape:
        """Latents and poses of the parts that are present; absent ones as the model knows them."""
        there = present[:, None]
        placed = [torch.where(there, a, b) for a, b in zip(poses, model.average_pose, strict=True)]
        return cls(model, torch.where(there, latents, model.absent_latent), PoseTensors(*placed), present)

    @classmethod
    def trained(cls, model: Model, name: str) -> NeuralShape:
        """A shape that the model was trained on, by name or number; raises SettingError for another."""
        if name in model.shapes:
            i = model.shapes.index(name)
        elif name.isdecimal() and int(name) < len(model.shapes):
            i = int(name)
        else:
            shown = ", ".join(model.shapes[:5])
            raise SettingError(
                f"{model.name} was not trained on {name!r}; name one of its {len(model.shapes)} shapes "
                f"({shown} ...) or give a number"
            )
        return cls(model, model.latents[i], model.poses.map(lambda t: t[i]), model.present[i])

    def names(self) -> list[str]:
        """Of the parts that are there."""
        return [n for n, there in zip(self.model.parts, self.present.tolist(), strict=True) if there]

    def part_distances(self, points: np.ndarray) -> np.ndarray:
        """(Q, N) float32 of the Q parts that are there, at points (N, 3) of the unit frame, in one pass."""
        size = CHUNK if self.model.asked == 1 else max(256, _CHUNK_OF_LAYERS // self.model.asked)
        chunks = torch.from_numpy(np.array(points, np.float32, order="C")).split(size)
        decoded = self._decoded

        @torch.no_grad()
        def decode(chunk: Tensor) -> Tensor:
            return decoded.parts(chunk)[self.present]

        return torch.cat(_side_by_side(decode, chunks), dim=1).numpy()

    @cached_property
    def _decoded(self) -> Decoded:
        with torch.no_grad():
            return self.model.decoded(self.latents, self.poses)

    @cached_property
    def walls(self) -> np.ndarray:
        """(Q,) about how thin each part that is there is, unit frame: twice a depth that few places inside
        exceed, and so at most about twice the depth at which training clamps; where this is much more than
        the depth of most, as in a tube with flanges, what most of it is thick. Infinite where no place inside
        is found."""
        names = self.names()
        places = np.concatenate([self.places(name) for name in names] or [np.zeros((0, 3), np.float32)])
        depths = -self.part_distances(places).reshape(len(names), len(names), _WALL_PLACES)
        return np.array([_wall(depths[i, i]) for i in range(len(names))])

    @cached_property
    def thinnest(self) -> float:
        """The least of `walls`; infinite where there is none."""
        return float(self.walls.min(initial=np.inf))

    def wall(self, name: str) -> float:
        """About how thin one part is, as in `walls`."""
        return _wall(-self.part_distances(self.places(name))[self.names().index(name)])

    def places(self, name: str, count: int = _WALL_PLACES) -> np.ndarray:
        """(count, 3) float32 in and a little around a part's cuboid, the same ones each time."""
        rng = np.random.default_rng(0)
        within = rng.uniform(-_CUBOID_MARGIN, _CUBOID_MARGIN, (count, 3)).astype(np.float32)
        pose = self.poses.map(lambda t: t[self.model.index(name)]).numpy()
        turned = Similarity(1.0, tuple(pose.rotation.tolist()), tuple(pose.translation.tolist()))
        return turned(within * pose.scale).astype(np.float32)

    def in_box(self, name: str, points: np.ndarray) -> np.ndarray:
        """(N, 3) of points (N, 3) of the unit frame, in a part's cuboid, whose sides are at -1 and 1."""
        own = self.poses.map(lambda t: t[self.model.index(name)][None])
        return local_points(torch.from_numpy(np.array(points, np.float32)), own)[0].numpy()

    def whole(self, distances: np.ndarray) -> np.ndarray:
        """(N,) distance of the whole shape, of its parts' (Q, N)."""
        return aggregate(torch.from_numpy(distances)[None], self.model.config.decoder)[0].numpy()

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(N,) float32 of the whole shape at points (N, 3) of the unit frame."""
        return self.whole(self.part_distances(points))


def _wall(depth: np.ndarray) -> float:
    """Of the depths (W,) of one part at its places, positive inside."""
    inside = depth[depth > 0]
    if not len(inside):
        return np.inf
    median, deep = np.quantile(inside, (0.5, _WALL_QUANTILE))
    # A tube with thick flanges: most of it is a wall, half of whose inside lies in its outer quarters.
    return float(4 * median if deep > _UNEVEN * median else 2 * deep)


def _side_by_side(decode: Callable[[Tensor], Tensor], chunks: Sequence[Tensor]) -> list[Tensor]:
    with one_core_each() as cores:
        if min(cores, len(chunks)) <= 1:
            return [decode(chunk) for chunk in chunks]
        with ThreadPoolExecutor(cores) as pool:
            return list(pool.map(decode, chunks))
