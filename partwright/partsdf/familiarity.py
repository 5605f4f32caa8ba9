"""Whether a shape is of the family that a model was trained on: what is left over, how odd its parts are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.targets import Target

# Measured by benchmarks/partsdf_familiarity.py: shapes of a family that were held out come to 0.08 at most,
# those of other families to 0.24 at least; real toys to 0.18, and since latents move as the family varies,
# cars and vehicles by the model of chairs to no more than they, so that these are not told. Odd latents alone
# say little, as many latents mean the same form: they count at most half again.
STRANGE, _MOST_ODD = 0.2, 1.5
# Of points, which do not tell inside from outside, errors are far smaller: a new car, chair and mixer came
# to 0.007 at most from 2,048 and from 30,000 points; with noise of 1 % of the diagonal, by halves, or by
# the model of another family, to 0.03 at least (with oddness) where what came out was bad.
STRANGE_POINTS = 0.02
ODD = 1.5  # times the farthest training shape's distance from the mean latent: as far as held-out shapes' lie
_SAMPLES = 8192


@dataclass(frozen=True)
class Familiarity:
    """How a reconstruction compares with what its model knows.

    residual: mean error of the distance near the surface, as a share of what losses clamp at (0.1 of the unit
    frame in the paper). latents: by part, how far its latent lies from the mean of the training shapes', each
    number in its own spread, as a multiple of the farthest training shape's. of_points: nothing but points of
    the surface was known.
    """

    model: str
    residual: float
    latents: dict[str, float]
    of_points: bool = False

    @property
    def strangeness(self) -> float:
        """The residual, up to half again where the oddest part is odder than those of held-out shapes."""
        return self.residual * min(_MOST_ODD, max(1.0, max(self.latents.values(), default=0.0) / ODD))

    def warnings(self) -> list[str]:
        """One line where the shape is none of the family, or too little is seen of it, else nothing."""
        if self.strangeness <= (STRANGE_POINTS if self.of_points else STRANGE):
            return []
        said = [f"its distances are off by {100 * self.residual:.0f} % of what counts as near"]
        unsure = ", or points with too much noise, or of a part of one" if self.of_points else ""
        part = max(self.latents, key=lambda name: self.latents[name], default="")
        if part and self.latents[part] > ODD:
            said.append(f"{part} is {self.latents[part]:.1f} times as odd as any that was trained on")
        return [
            f"this may be no shape of the family that {self.model} knows{unsure}: {', and '.join(said)}; "
            "look at preview.png, or take another model or method"
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
    return Familiarity(shape.model.name, residual, latents, target.low is not None)


def oddness(model: Model, part: int, latent: torch.Tensor) -> float:
    """How far a latent (Z,) lies from the mean of the training shapes', as a multiple of their farthest."""
    known = model.latents[model.present[:, part], part]
    if len(known) < 2:
        return 0.0
    mean, spread = known.mean(dim=0), known.std(dim=0).clamp(min=1e-6)
    farthest = ((known - mean) / spread).norm(dim=1).max()
    return float(((latent - mean) / spread).norm() / farthest)
