"""One shape whose latents and poses a decoder has taken in: asked for all of its parts, or for one."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from partwright.partsdf.decoder import Conditioned
from partwright.partsdf.local import LocalConditioned
from partwright.partsdf.poses import PoseTensors, local_points


@dataclass(frozen=True)
class Decoded:
    """conditioned: of a batch of one; poses (P, ...)."""

    conditioned: Conditioned
    poses: PoseTensors

    def parts(self, points: Tensor) -> Tensor:
        """Distances (P, N) of all parts at points (N, 3), unit frame."""
        return self.conditioned(local_points(points, self.poses)[None])[0]

    def part(self, number: int, points: Tensor) -> Tensor:
        """(N,) of the one part of that number."""
        if not isinstance(self.conditioned, LocalConditioned):  # its parts hear of one another at each point
            return self.parts(points)[number]
        own = local_points(points, self.poses.map(lambda t: t[number : number + 1]))
        return self.conditioned.of(number)(own[None])[0, 0]
