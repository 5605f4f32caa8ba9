"""How an image encoder learns which pictures show a shape of the family at all: from heaps that show none.

An encoder makes a shape of the family of whatever it is shown, and how sure it is of that tells little. What
its convolutions see tells more: they were made for the family's pictures, which show other things, and more
clearly, than pictures of heaps of blocks, balls, cones and rings, both before plain grounds and cluttered
ones. One weight for each of these things is learned, by logistic regression, once all else is; what is seen
of the family stays as it is.
"""

from __future__ import annotations

import math

import torch
import trimesh
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from partwright.partsdf.image_encoder import ImageNetwork
from partwright.partsdf.lighting import before_clutter, lit
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.views import EACH, PartMeshes, Views, views_of

HEAPS = 1440  # views at most, and of the family's
_MORE = 2  # times as many heaps as there are views of the family, at most
_MOST = 8  # solids of a heap
_SIZE, _VARIED = math.log(0.2), 0.6  # mean and standard deviation of the logarithm of their half-lengths
_UPRIGHT = _ROUND = 0.5  # of them
_LIT = 3  # times that each view is lit
_BATCH = 64
_HELD = 1e-2  # weight of the squares of what is learned
_STEPS = 200


def learn_likeness(
    network: ImageNetwork, own: Views, up: str, generator: torch.Generator, workers: int = 1
) -> None:
    """Fit `network.known`, in place, to tell views of the family from those of heaps, which stand with the
    axis `up`. workers: processes, as of `draw_views`."""
    heaps = draw_heaps(up, min(HEAPS, _MORE * len(own.label)), generator, workers)
    rows = torch.randperm(len(own.label), generator=generator)[:HEAPS]
    every = torch.arange(len(heaps.label))
    seen = [_features(network, own, rows, generator), _features(network, heaps, every, generator)]
    x = torch.cat(seen)
    y = torch.cat([torch.full((len(f),), v) for f, v in zip(seen, (1.0, 0.0), strict=True)])
    share = torch.cat([torch.full((len(f),), 0.5 / len(f)) for f in seen])
    middle, spread = x.mean(dim=0), x.std(dim=0) + 1e-6
    weights, bias = torch.zeros(x.shape[1], requires_grad=True), torch.zeros(1, requires_grad=True)
    optimiser = torch.optim.LBFGS([weights, bias], max_iter=_STEPS)
    standing = (x - middle) / spread

    def loss() -> Tensor:
        optimiser.zero_grad()
        off = binary_cross_entropy_with_logits(standing @ weights + bias, y, reduction="none")
        total = (share * off).sum() + _HELD * weights.square().sum()
        total.backward()
        return total

    optimiser.step(loss)
    with torch.no_grad():
        network.known.weight.copy_((weights / spread)[None])
        network.known.bias.copy_(bias - (weights * middle / spread).sum())


def draw_heaps(up: str, count: int, generator: torch.Generator, workers: int = 1) -> Views:
    """`count` views of heaps of solids, as `draw_views` has them of a family."""
    solids = [
        trimesh.creation.box((2, 2, 2)),
        trimesh.creation.cylinder(1, 2, sections=32),
        trimesh.creation.icosphere(3, 1),
        trimesh.creation.cone(1, 2, sections=32).apply_translation((0, 0, -1)),
        trimesh.creation.torus(0.8, 0.2, major_sections=32, minor_sections=12),
    ]
    meshes = PartMeshes([[s.vertices] * _MOST for s in solids], [[s.faces] * _MOST for s in solids])
    heaps = -(-count // EACH)
    size = heaps, _MOST

    def chance(share: float) -> Tensor:
        return torch.rand(*size, 1, generator=generator) < share

    lengths = torch.exp(_SIZE + _VARIED * torch.randn(*size, 3, generator=generator))
    turned = torch.nn.functional.normalize(torch.randn(*size, 4, generator=generator), dim=-1)
    poses = PoseTensors(
        torch.rand(*size, 3, generator=generator) - 0.5,
        torch.where(chance(_UPRIGHT), torch.tensor([1.0, 0.0, 0.0, 0.0]), turned),
        torch.where(chance(_ROUND), lengths[..., :1], lengths),
    )
    donors = torch.randint(len(solids), size, generator=generator)
    present = torch.arange(_MOST) < torch.randint(1, _MOST + 1, (heaps, 1), generator=generator)
    return views_of(meshes, up, donors, poses, present, count, generator, workers=workers)


@torch.no_grad()
def _features(network: ImageNetwork, views: Views, rows: Tensor, generator: torch.Generator) -> Tensor:
    """(_LIT R, F) of pictures of the views `rows` (R,)."""
    lights = (lit(views, some, generator) for _ in range(_LIT) for some in rows.split(_BATCH))
    pictures = (before_clutter(*each, generator) for each in lights)
    return torch.cat([network.features(*network.scales(one)[1:]) for one in pictures])
