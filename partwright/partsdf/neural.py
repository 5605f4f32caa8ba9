"""A shape as its model knows it: latents and poses of all parts, in the unit frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from partwright.assembly.similarity import Similarity
from partwright.errors import SettingError
from partwright.partsdf.losses import aggregate
from partwright.partsdf.model import Model
from partwright.partsdf.poses import PoseTensors, local_points

_PLACES, _ROOM = 4000, 1.05  # where walls are looked for, in and around a part's cuboid
_DEEP = 0.95
CHUNK = 1 << 12  # pairs of point and part that are decoded at once, so that they stay in the cache


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

    @torch.no_grad()
    def part_distances(self, points: np.ndarray) -> np.ndarray:
        """(Q, N) float32 of the Q parts that are there, at points (N, 3) of the unit frame, in one pass."""
        conditioned = self.model.condition(self.latents[None])
        size = max(256, CHUNK // len(self.latents))
        chunks = torch.from_numpy(np.array(points, np.float32, order="C")).split(size)
        values = [conditioned(local_points(chunk, self.poses)[None])[0][self.present] for chunk in chunks]
        return torch.cat(values, dim=1).numpy()

    def walls(self) -> np.ndarray:
        """(Q,) about how thin each part that is there is."""
        return np.array([self.wall(name) for name in self.names()])

    def wall(self, name: str) -> float:
        """About how thin a part is, unit frame: twice a depth that few places inside exceed, and so at most
        about twice the depth at which training clamps. Infinite where no place inside is found."""
        within = np.random.default_rng(0).uniform(-_ROOM, _ROOM, (_PLACES, 3)).astype(np.float32)
        pose = self.poses.map(lambda t: t[self.model.index(name)]).numpy()
        turned = Similarity(1.0, tuple(pose.rotation.tolist()), tuple(pose.translation.tolist()))
        depth = -self.part_distances(turned(within * pose.scale))[self.names().index(name)]
        return float(2 * np.quantile(depth[depth > 0], _DEEP)) if (depth > 0).any() else np.inf

    def whole(self, distances: np.ndarray) -> np.ndarray:
        """(N,) distance of the whole shape, of its parts' (Q, N)."""
        return aggregate(torch.from_numpy(distances)[None], self.model.config.decoder)[0].numpy()

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(N,) float32 of the whole shape at points (N, 3) of the unit frame."""
        return self.whole(self.part_distances(points))
