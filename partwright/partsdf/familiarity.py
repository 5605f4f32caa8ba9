"""Whether a shape is of the family that a model was trained on: what is left over, how its parts lie."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from partwright.partsdf.layout import layout_oddness
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import Frame

# Chosen on 72 shapes: real ones, and those of seeds 2 and 3 of the made families; of others 42 of 46
# strangers are told (benchmarks/partsdf_familiarity.py). A fit that is off by more is poor, whatever the
# reason: new shapes of a family come to 0.05 at most, real ones of its kind to 0.12. What is of another
# family may be met as closely as these, but by parts that are oddly formed and placed: both together make
# 0.68 at most of real ones of a kind, and 0.78 at least of all but poor ones.
POOR = 0.17
STRANGE = 0.73
# Of points, which do not tell inside from outside, errors are far smaller: a new shape of each family
# came to 0.02 at most from 2,048, a chair with noise of a half of 1 % of its length, found at an IoU of 0.90,
# to 0.03, one of which half was missing to 0.08, and what is of another family to 0.17 at least.
STRANGE_POINTS = 0.04
ODD = 1.5  # times the farthest training shape's distance from the mean latent: as far as held-out shapes' lie
_ODDEST = 2.0  # times; what is farther from all latents that were learned says no more
_SAMPLES = 8192


@dataclass(frozen=True)
class Familiarity:
    """How a reconstruction compares with what its model knows.

    residual: mean error of the distance near the surface, as a share of what losses clamp at (0.1 of the unit
    frame in the paper). latents: by part, how far its latent lies from the mean of the training shapes', each
    number in its own spread, as a multiple of the farthest training shape's. layout: how far the poses of all
    parts together lie from the training shapes', as a multiple of what is usual among these. of_points:
    nothing but points of the surface was known.
    """

    model: str
    residual: float
    latents: dict[str, float]
    layout: float
    of_points: bool = False

    @property
    def strangeness(self) -> float:
        """The residual, as many times as parts lie farther from the usual than the family's do, and as its
        oddest part is formed more oddly; of points, which tell little of forms, by how they lie alone."""
        off = self.residual * max(1.0, self.layout)
        return off if self.of_points else off * min(max((1.0, *self.latents.values())), _ODDEST)

    @property
    def odd(self) -> bool:
        """Whether its parts tell that the shape is none of the family, or that too little is seen of it."""
        return self.strangeness > (STRANGE_POINTS if self.of_points else STRANGE)

    @property
    def poor(self) -> bool:
        """Whether the shape is met so badly that it is none of the family, however its parts are."""
        return self.residual > POOR

    def warnings(self) -> list[str]:
        """One line where the shape is none of the family, or too little is seen of it, else nothing."""
        if not (self.odd or self.poor):
            return []
        said = [f"its distances are off by {100 * self.residual:.0f} % of what counts as near"]
        unsure = ", or points with too much noise, or of a part of one" if self.of_points else ""
        if self.layout > 1:
            said.append(f"its parts lie {self.layout:.1f} times as far from the usual as the family's")
        part = max(self.latents, key=lambda name: self.latents[name], default="")
        if part and self.latents[part] > ODD:
            said.append(f"{part} is {self.latents[part]:.1f} times as odd as any that was trained on")
        return [
            f"this may be no shape of the family that {self.model} knows{unsure}: {', and '.join(said)}; "
            "look at the picture, or take another model or method"
        ]


@torch.no_grad()
def familiarity(shape: NeuralShape, target: Target) -> Familiarity:
    """Of a shape as it was found, and its target in the family's frame."""
    losses = replace(shape.model.config.losses, hard=0.0)
    rows = torch.linspace(0, len(target.sdf) - 1, min(_SAMPLES, len(target.sdf))).long()
    whole = torch.from_numpy(shape.distances(target.points[rows].numpy()))
    residual = float(target.error(whole, rows, losses).mean()) / losses.clamp
    present = np.flatnonzero(shape.present.numpy()).tolist()
    latents = {shape.model.parts[p]: oddness(shape.model, p, shape.latents[p]) for p in present}
    of_points = target.low is not None
    if of_points:  # perhaps of a piece, in whose frame the shape is larger and elsewhere
        frame = Frame.of(PartVectors.of(shape.model), shape.poses)
        shape = replace(shape, poses=frame.to_family(shape.poses))
    return Familiarity(shape.model.name, residual, latents, layout_oddness(shape), of_points)


def oddness(model: Model, part: int, latent: torch.Tensor) -> float:
    """How far a latent (Z,) lies from the mean of the training shapes', as a multiple of their farthest."""
    known = model.latents[model.present[:, part], part]
    if len(known) < 2:
        return 0.0
    mean, spread = known.mean(dim=0), known.std(dim=0).clamp(min=1e-6)
    farthest = ((known - mean) / spread).norm(dim=1).max()
    return float(((latent - mean) / spread).norm() / farthest)
