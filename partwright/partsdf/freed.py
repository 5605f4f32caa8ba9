"""Shapes beyond what a family varies by: once they are near, latents and poses move freely.

In the family's spread a search is quick, and keeps to what the family has. A real truck is of no made family,
though: what is left over there is not to be had along the family's directions. It is by numbers that move by
themselves, from where the family leads to. Which shapes are none of the family is told before that, from how
oddly they are made; such are left as they are.
"""

from __future__ import annotations

from dataclasses import replace

from partwright.methods import Checkpoint
from partwright.partsdf.familiarity import Familiarity, familiarity
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.optimisation import optimised, poses_move
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target

# Of what counts as near. New shapes of each family that ships come to less, and gain little; real ones of its
# kind to more.
_FAR = 0.03
_FASTER, _POSES_FASTER = 4.0, 2.5  # over the rates of a search where parts are known


def judged(
    shape: NeuralShape,
    target: Target,
    settings: ReconstructionSettings,
    seed: int = 0,
    checkpoint: Checkpoint | None = None,
) -> tuple[NeuralShape, Familiarity]:
    """How a shape that was found along the family's directions compares with the family, and the shape: moved
    on freely, for as many iterations again, where it is of the family but not near yet."""
    known = familiarity(shape, target)
    if target.low is not None or known.warnings() or known.residual <= _FAR:
        return shape, known
    # Parts hear of those that are not there, too, of which an assembly knows nothing.
    shape = NeuralShape.of(shape.model, shape.latents, shape.poses, shape.present)
    again = replace(
        settings,
        rate=min(1.0, _FASTER * settings.rate),
        pose_rate=min(1.0, _POSES_FASTER * settings.pose_rate),
        pose_delay=0.0,
    )
    moving = poses_move(shape.model, settings)
    return optimised(shape, target, again, seed, None, checkpoint, moving, freely=True)[0], known
