"""Where the search of an unknown shape begins: how it stands, near which training shapes, with which parts.

Nobody's mesh stands as the family does, so the turns about the up axis are tried, and all up axes where it is
unknown: each asks for no more than the distances of the training shapes at a few samples. And a shape of the
family may be made of parts of several training shapes: each part of a start is exchanged for that of another
one wherever this brings the whole closer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import torch
from torch import Tensor

from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import NO_ROTATION, quaternion_product
from partwright.datasets.prepared import UP
from partwright.errors import ModelError, SettingError
from partwright.partsdf.encoder import Encoder, load_encoder
from partwright.partsdf.losses import aggregate, clamped_error
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors, local_points
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import Frame
from partwright.shapes import LONGEST_SIDE

_HALF = math.sqrt(0.5)
# From z up to another axis up.
_FROM_Z: dict[str, Quaternion] = {
    "z": NO_ROTATION,
    "-z": (0.0, 1.0, 0.0, 0.0),
    "y": (_HALF, -_HALF, 0.0, 0.0),
    "-y": (_HALF, _HALF, 0.0, 0.0),
    "x": (_HALF, 0.0, _HALF, 0.0),
    "-x": (_HALF, 0.0, -_HALF, 0.0),
}
_CLEARLY = 0.85  # of the error as the shape stands: less is worth a turn
_JUDGES, _TURNS = 32, 2  # training shapes that turns are judged by, and how many of these go on
_MISSING = (0.15, 0.3, 0.5)  # of a shape's length along an axis, that a scan of a piece of it may lack
_FRAMES = 4  # besides the scan's own, that go on
_AT_ONCE = 16  # shapes that are decoded together
_PART_SAMPLES = 2048  # of a target with known parts
_OTHERS, _SAMPLES = 48, 512  # training shapes that parts are taken from, and samples they are judged at
_FEW, _LIKELY = 4, 16  # of these every fourth tells which parts come into question at all


@dataclass(frozen=True)
class Start:
    """A shape to begin from, the turn from the family's frame to the target's, and the target before it.
    encoded: whether an encoder saw it in the target, rather than a training shape being near."""

    shape: NeuralShape
    turn: Quaternion
    target: Target
    encoded: bool = False


def find_starts(
    model: Model, target: Target, turns: list[Quaternion], settings: ReconstructionSettings
) -> list[Start]:
    """Shapes to begin from, as the settings ask for; one, or several to choose from.

    Raises:
        ModelError: an encoder is asked for, and the model has none; or its file is damaged.
        EmptyShapeError, ParameterError, SettingError: as `encoded_start`.
    """
    encoder = load_encoder(model) if settings.start in ("auto", "encoder") else None
    if encoder is None and settings.start == "encoder":
        raise ModelError(
            f"{model.name} has no encoder; make one with `parts train-encoder`, or start from the nearest"
        )
    if settings.start == "mean":
        return [Start(NeuralShape.mean(model), turns[0], target.turned(turns[0]))]
    if encoder is None or (settings.start == "auto" and target.surface is None):
        return best_starts(model, target, settings.starts, turns)
    seen = encoded_start(encoder, target, turns)
    others = settings.starts - 1 if settings.start == "auto" else 0
    return [seen, *(best_starts(model, target, others, turns) if others else [])]


def ways_to_stand(up: str | None, family: str = UP) -> list[Quaternion]:
    """Turns from how the family stands to how a shape may, the first of which is none.

    up: the shape's, family: the family's axis that points up. All 24 where the shape's is unknown. Else
    those that bring the family's to it, after those about it where the two differ: the family may not stand
    as is said.
    """
    if up is None:
        others = [axis for axis in _FROM_Z if axis != family]
        return [turn for axis in (family, *others) for turn in _raised(axis, family)]
    return [*(_raised(up, up) if up != family else []), *_raised(up, family)]


def _raised(up: str, family: str) -> list[Quaternion]:
    """The four turns that bring one axis to the other."""
    half = math.pi / 4
    about = [(math.cos(k * half), 0.0, 0.0, math.sin(k * half)) for k in range(4)]
    w, x, y, z = _FROM_Z[family]
    return [quaternion_product(quaternion_product(_FROM_Z[up], turn), (w, -x, -y, -z)) for turn in about]


@torch.no_grad()
def best_starts(model: Model, target: Target, most: int, turns: list[Quaternion]) -> list[Start]:
    """The `most` ways to stand and training shapes that come closest together, the closest first. Points are
    also looked at as those of a piece of a larger shape.

    Another way than the first has to be clearly better than that one.
    """
    turned = [target.turned(turn) for turn in turns]
    few = torch.linspace(0, len(model.latents) - 1, min(_JUDGES, len(model.latents))).long()
    rows, poses = _rows(target, _SAMPLES // 4), model.poses.map(lambda t: t[few])
    least = [float(errors_of(model, model.latents[few], poses, seen, rows).min()) for seen in turned]
    better = sorted(range(1, len(turns)), key=lambda k: least[k])[:_TURNS]
    kept = [0, *(k for k in better if least[k] < _CLEARLY * least[0])]
    found = [
        (error, k, shape)
        for k in kept
        for frame in _frames(model, turned[k], rows)
        for error, shape in nearest_trained(model, turned[k], most, frame=frame)
    ]
    as_it_stands = min(error for error, k, _ in found if k == 0)
    good = [entry for entry in found if entry[1] == 0 or entry[0] < _CLEARLY * as_it_stands]
    good.sort(key=lambda entry: entry[0])
    return [Start(shape, turns[k], turned[k]) for _, k, shape in good[:most]]


@torch.no_grad()
def encoded_start(encoder: Encoder, target: Target, turns: list[Quaternion]) -> Start:
    """What the encoder sees in the target's surface, the way that it stands which is judged as in
    `best_starts`.

    Raises:
        SettingError: nothing is known of the surface.
        EmptyShapeError, ParameterError: as `Encoder.encode`.
    """
    if target.surface is None:
        raise SettingError("points on the surface are needed for an encoder; start from the nearest instead")
    model = encoder.model
    turned = [target.turned(turn) for turn in turns]
    clouds = torch.stack([t.surface for t in turned if t.surface is not None])
    seen = encoder.encode(clouds)
    rows = _rows(target, _SAMPLES)
    errors = [
        float(errors_of(model, one.latents[None], one.poses.map(lambda t: t[None]), where, rows))
        for one, where in zip(seen, turned, strict=True)
    ]
    best = min(range(len(turns)), key=lambda k: errors[k])
    if errors[best] >= _CLEARLY * errors[0]:
        best = 0
    return Start(seen[best], turns[best], turned[best], encoded=True)


@torch.no_grad()
def nearest_trained(
    model: Model, target: Target, most: int = 1, count: int = _SAMPLES, frame: Frame | None = None
) -> list[tuple[float, NeuralShape]]:
    """The `most` training shapes whose distances differ least from the target's, and by how much.

    At `count` of its points; a quarter of these tells which shapes come into question at all. frame: of the
    family in the target's, if that is another.
    """
    model_poses = model.poses if frame is None else frame.from_family(model.poses)
    rows = _rows(target, count)
    everyone = torch.arange(len(model.latents))
    likely = errors_of(model, model.latents, model_poses, target, rows[::4]).argsort()
    likely = everyone[likely[: max(4 * most, len(likely) // 8)]]
    poses = model_poses.map(lambda t: t[likely])
    errors = errors_of(model, model.latents[likely], poses, target, rows)
    order = errors.argsort()[:most].tolist()
    found = [(float(errors[i]), NeuralShape.trained(model, str(int(likely[i])))) for i in order]
    if frame is None:
        return found
    return [(error, replace(shape, poses=frame.from_family(shape.poses))) for error, shape in found]


def _frames(model: Model, target: Target, rows: Tensor) -> list[Frame | None]:
    """Of the family in a target's frame: the same; and of points, which may be of a piece of the shape, those
    which training shapes lie in best if one side is missing."""
    if target.low is None:
        return [None]
    seen = target.points[target.sdf <= 0]
    ends = torch.stack([seen.amin(dim=0), seen.amax(dim=0)])
    frames = []
    for axis, end, missing in product(range(3), range(2), _MISSING):
        whole = ends.clone()
        whole[end, axis] += (2 * end - 1) * (ends[1] - ends[0])[axis] * missing / (1 - missing)
        longest = (whole[1] - whole[0]).amax()
        frames.append(Frame(whole.mean(dim=0), (longest / LONGEST_SIDE).log()))
    few = torch.linspace(0, len(model.latents) - 1, min(_JUDGES, len(model.latents))).long()
    latents, poses = model.latents[few], model.poses.map(lambda t: t[few])
    least = [float(errors_of(model, latents, one.from_family(poses), target, rows).min()) for one in frames]
    return [None, *(frames[i] for i in np.argsort(least)[:_FRAMES])]


@torch.no_grad()
def exchanged_parts(shape: NeuralShape, target: Target, seed: int = 0, likely: int = _LIKELY) -> NeuralShape:
    """Each part by itself, the one that most samples are nearest to first, is exchanged for that of another
    training shape, at that one's place, or at its own, where this brings the whole closer.

    likely: so many of the exchanges are judged at all samples, those that are best at every fourth.
    """
    model = shape.model
    rows = _rows(target, _SAMPLES)
    drawn = torch.randperm(len(model.latents), generator=torch.Generator().manual_seed(seed))[:_OTHERS]
    best = float(errors_of(model, shape.latents[None], shape.poses.map(lambda t: t[None]), target, rows))
    owner = shape.part_distances(target.points[rows].numpy()).argmin(axis=0)
    numbers = np.flatnonzero(shape.present.numpy())
    for part in numbers[np.argsort(-np.bincount(owner, minlength=len(numbers)), kind="stable")].tolist():
        latents = shape.latents.repeat(2 * len(drawn), 1, 1)
        latents[:, part] = model.latents[drawn, part].repeat(2, 1)
        poses = shape.poses.map(lambda t: t.repeat(2 * len(drawn), *[1] * t.ndim))
        for mine, theirs in zip(poses, model.poses, strict=True):
            mine[: len(drawn), part] = theirs[drawn, part]
        kept = errors_of(model, latents, poses, target, rows[::_FEW]).argsort()[:likely]
        latents, poses = latents[kept], poses.map(lambda t, kept=kept: t[kept])
        errors = errors_of(model, latents, poses, target, rows)
        least = int(errors.argmin())
        if errors[least] < best:
            best = float(errors[least])
            shape = replace(
                shape, latents=latents[least].clone(), poses=poses.map(lambda t, i=least: t[i].clone())
            )
    return shape


@torch.no_grad()
def latents_by_part(model: Model, poses: PoseTensors, target: Target, most: int = 1) -> Tensor:
    """(K, P, Z): of each part, the latents of the up to `most` training shapes whose part is closest, the
    closest first, in the pose (P, ...) that is known. Parts that no sample is nearest to have the mean's.

    From the mean alone a blade that winds the other way, say, is never found.
    """
    count = len(model.latents)
    errors = errors_by_part(model, model.latents, poses.map(lambda t: t.expand(count, *t.shape)), target)
    order = errors.masked_fill(~model.present, torch.inf).argsort(dim=0)[:most]
    closest = model.latents[order, torch.arange(len(model.parts))]
    assert target.part is not None
    seen = torch.zeros(len(model.parts), dtype=torch.bool)
    seen[target.part.unique()] = True
    return torch.where((seen & model.present.any(dim=0))[:, None], closest, model.mean_latent)


@torch.no_grad()
def errors_by_part(model: Model, latents: Tensor, poses: PoseTensors, target: Target) -> Tensor:
    """(S, P) error of each part of shapes with latents (S, P, Z) and poses (S, P, ...): the sum over those of
    a target's samples that belong to it."""
    rows = _rows(target, _PART_SAMPLES)
    assert target.part is not None
    points, owner, known = target.points[rows], target.part[rows], target.sdf[rows]
    member = torch.nn.functional.one_hot(owner, len(model.parts)).float()
    errors = []
    for each in _decoded(model, latents, poses, points):
        own = each.gather(1, owner.expand(len(each), 1, -1)).squeeze(1)
        errors.append(clamped_error(own, known, model.config.losses) @ member)
    return torch.cat(errors)


def _rows(target: Target, count: int) -> Tensor:
    return torch.linspace(0, len(target.sdf) - 1, count).long()


@torch.no_grad()
def errors_of(model: Model, latents: Tensor, poses: PoseTensors, target: Target, rows: Tensor) -> Tensor:
    """Mean error (S,) of the whole distance of shapes with latents (S, P, Z) and poses (S, P, ...), at the
    target's samples `rows`."""
    errors = []
    for each in _decoded(model, latents, poses, target.points[rows]):
        whole = aggregate(each, model.config.decoder)
        errors.append(target.error(whole, rows, model.config.losses).mean(dim=1))
    return torch.cat(errors)


def _decoded(model: Model, latents: Tensor, poses: PoseTensors, points: Tensor) -> Iterator[Tensor]:
    """Distances (B, P, N) at points (N, 3) of the parts of all shapes, a few shapes at a time."""
    for first in range(0, len(latents), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        placed = poses.map(lambda t, some=some: t[some])
        yield model.condition(latents[some], placed)(local_points(points, placed))
