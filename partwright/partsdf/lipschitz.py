"""How steep a trained decoder is: the margin that sparse meshing needs."""

from __future__ import annotations

import torch

from partwright.partsdf.data import FamilySamples
from partwright.partsdf.model import Model

GRADIENT_QUANTILE = 0.999
MARGIN = 1.05
_MAX_SHAPES, _POINTS_PER_SHAPE = 16, 2048


def measured_lipschitz(model: Model, samples: FamilySamples) -> float:
    """The `GRADIENT_QUANTILE` of the gradients' lengths of all parts' distances, times `MARGIN`; at least 1.

    Measured on up to 16 training shapes, at their samples and at as many points spread over [-1, 1]^3.
    """
    generator = torch.Generator().manual_seed(0)
    found = []
    for i in torch.linspace(0, len(samples) - 1, min(_MAX_SHAPES, len(samples))).long().tolist():
        rows = torch.randint(samples.points.shape[1], (_POINTS_PER_SHAPE // 2,), generator=generator)
        spread = 2 * torch.rand(_POINTS_PER_SHAPE // 2, 3, generator=generator) - 1
        points = torch.cat([samples.points[i, rows], spread]).requires_grad_()
        each = model.part_distances(model.latents[i], samples.poses.map(lambda t, i=i: t[i]), points)
        distances = each[samples.present[i]]
        for row in distances:
            (gradient,) = torch.autograd.grad(row.sum(), points, retain_graph=True)
            found.append(gradient.norm(dim=1))
    lengths = torch.cat(found)
    rank = max(1, round(GRADIENT_QUANTILE * len(lengths)))
    return max(1.0, MARGIN * float(lengths.kthvalue(rank).values))
