"""Edits of neural shapes: latents and poses of single parts, to which all other parts adapt (section 4.3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from partwright.errors import ModelError, SettingError
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import between


def swapped(shape: NeuralShape, part: str, source: NeuralShape) -> NeuralShape:
    """One part's latent taken from another shape of the same model; its pose stays."""
    _same_model(shape, source)
    return with_latent(shape, part, source.latents[shape.model.index(part)])


def resampled(shape: NeuralShape, part: str, seed: int) -> NeuralShape:
    """One part's latent drawn from the normal distribution of those of the training shapes that have it."""
    index = shape.model.index(part)
    known = shape.model.latents[shape.model.present[:, index], index].double().numpy()
    # A random mixture of deviations has the sample's covariance, even of fewer shapes than numbers.
    deviations = known - known.mean(axis=0)
    weight = np.random.default_rng(seed).standard_normal(len(known)) / max(1, len(known) - 1) ** 0.5
    return with_latent(shape, part, torch.from_numpy(known.mean(axis=0) + weight @ deviations).float())


def with_latent(shape: NeuralShape, part: str, latent: Tensor) -> NeuralShape:
    """One part with the latent (Z,); a part that was absent is there now."""
    index = shape.model.index(part)
    latents, present = shape.latents.clone(), shape.present.clone()
    latents[index], present[index] = latent, True
    return replace(shape, latents=latents, present=present)


def moved(shape: NeuralShape, part: str, offset: Sequence[float]) -> NeuralShape:
    """One part's place changed by (x, y, z), unit frame."""
    translation = shape.poses.translation.clone()
    translation[_posed(shape, part)] += torch.tensor(offset, dtype=torch.float32)
    return replace(shape, poses=shape.poses._replace(translation=translation))


def turned(shape: NeuralShape, part: str, axis: Sequence[float], degrees: float) -> NeuralShape:
    """One part turned about its own centre, around an axis (x, y, z) of the unit frame, right-handed."""
    length = math.hypot(*axis)
    if not length > 0:
        raise SettingError(f"the axis {tuple(axis)} has no direction; expected three numbers, not all zero")
    half = math.radians(degrees) / 2
    turn = torch.tensor([math.cos(half), *(math.sin(half) * a / length for a in axis)])
    rotation = shape.poses.rotation.clone()
    index = _posed(shape, part)
    rotation[index] = _product(turn, rotation[index])
    return replace(shape, poses=shape.poses._replace(rotation=rotation))


def scaled(shape: NeuralShape, part: str, factors: Sequence[float]) -> NeuralShape:
    """One part's half-lengths times (x, y, z) along its own axes."""
    if not all(f > 0 and math.isfinite(f) for f in factors):
        raise SettingError(f"the factors are {tuple(factors)}; expected three numbers above 0")
    scale = shape.poses.scale.clone()
    scale[_posed(shape, part)] *= torch.tensor(factors, dtype=torch.float32)
    return replace(shape, poses=shape.poses._replace(scale=scale))


def without(shape: NeuralShape, *parts: str) -> NeuralShape:
    """Parts that are known to be absent dropped (section 5): the others see them as absent in training.

    Raises:
        SettingError: a part has another name, or no part would be left.
    """
    gone = [shape.model.index(part) for part in parts]
    latents, present = shape.latents.clone(), shape.present.clone()
    poses = shape.poses.map(Tensor.clone)
    for index in gone:
        latents[index], present[index] = shape.model.absent_latent[index], False
        for mine, average in zip(poses, shape.model.average_pose, strict=True):
            mine[index] = average[index]
    if not present.any():
        raise SettingError(f"no part of {shape.model.name} would be left; keep at least one")
    return replace(shape, latents=latents, poses=poses, present=present)


def interpolated(a: NeuralShape, b: NeuralShape, t: float) -> NeuralShape:
    """Between a (t = 0) and b (t = 1): latents, places and half-lengths straight, rotations by slerp.

    A part that only one of the two has is there from or until the middle (appendix E leaves it to the
    network, which may leave crumbs of it floating: section 5).
    """
    _same_model(a, b)
    present = a.present & b.present | (a.present if t < 0.5 else b.present)
    return replace(
        a, latents=torch.lerp(a.latents, b.latents, t), poses=between(a.poses, b.poses, t), present=present
    )


def _posed(shape: NeuralShape, part: str) -> int:
    if not shape.model.config.poses or shape.model.config.one_part:
        raise SettingError(f"{shape.model.name} was trained without poses; only latents can be edited")
    return shape.model.index(part)


def _product(a: Tensor, b: Tensor) -> Tensor:
    from partwright.assembly.similarity import quaternion_product

    first, second = (tuple(float(v) for v in q) for q in (a, b))
    return torch.tensor(quaternion_product(first, second))  # type: ignore[arg-type]


def _same_model(a: NeuralShape, b: NeuralShape) -> None:
    if a.model.hash != b.model.hash:
        raise ModelError(f"the shapes are of different models, {a.model.name} and {b.model.name}; take one")
