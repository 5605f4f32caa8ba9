"""How much the decoder feels a change of a latent: what an image encoder's errors are weighed by.

An auto-decoder leaves in its latents what they began with at random, wherever the decoder does not listen.
No picture tells that part, so an encoder is not asked for it.
"""

from __future__ import annotations

import torch
from torch import Tensor

from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import PartVectors

_SHAPES, _POINTS, _PROBES = 48, 64, 12
_NEAR = 0.05  # unit lengths: distances that are larger count for nothing


def felt(model: Model, vectors: PartVectors, seed: int = 0) -> Tensor:
    """(P, K, K): errors off (K,) of vectors, each along its direction in its spread, come to |off @ felt|^2,
    a share of what the part's latents vary by, in squares of the distances that they change near the surface
    (Gauss-Newton), at random local points of training shapes.
    """
    generator = torch.Generator().manual_seed(seed)
    rows = torch.randperm(len(model.latents), generator=generator)[:_SHAPES]
    poses = model.poses.map(lambda t: t[rows])
    parts = len(model.parts)
    local = 2.2 * torch.rand(len(rows), parts, _POINTS, 3, generator=generator) - 1.1
    latents = model.latents[rows].clone().requires_grad_(True)
    with torch.enable_grad():
        distances = model.condition(latents, poses)(local)
        near = (distances.detach().abs() < _NEAR) & model.present[rows][..., None]
        total = torch.zeros(parts, latents.shape[2], latents.shape[2])
        for probe in range(_PROBES):  # by random signs, the squares of sums are the sums of squares
            signs = torch.randint(2, near.shape, generator=generator) * 2.0 - 1
            (slope,) = torch.autograd.grad(
                (signs * near * distances).sum(), latents, retain_graph=probe + 1 < _PROBES
            )
            total += torch.einsum("spz,spw->pzw", slope, slope)
    along = vectors.directions * vectors.spread[..., None]  # (P, K, Z)
    squares = along @ total @ along.transpose(1, 2)
    varied = squares.diagonal(dim1=1, dim2=2).sum(-1).clamp(min=1e-12)
    values, axes = torch.linalg.eigh(squares / varied[:, None, None])
    return axes * values.clamp(min=0).sqrt()[:, None]
