"""How steep a trained decoder is: the margin that sparse meshing needs."""

from __future__ import annotations

import torch

from partwright.partsdf.data import Samples
from partwright.partsdf.model import Model
from partwright.partsdf.poses import local_points

QUANTILE = 0.999
MARGIN = 1.05
_SHAPES, _POINTS = 16, 2048


def measured_slope(model: Model, samples: Samples) -> float:
    """The `QUANTILE` of the gradients' lengths of all parts' distances, times `MARGIN`; at least 1.

    Measured on up to 16 training shapes, at their samples and at as many points spread over [-1, 1]^3.
    """
    generator = torch.Generator().manual_seed(0)
    found = []
    for i in torch.linspace(0, len(samples) - 1, min(_SHAPES, len(samples))).long().tolist():
        rows = torch.randint(samples.points.shape[1], (_POINTS // 2,), generator=generator)
        spread = 2 * torch.rand(_POINTS // 2, 3, generator=generator) - 1
        points = torch.cat([samples.points[i, rows], spread]).requires_grad_()
        local = local_points(points, samples.poses.map(lambda t, i=i: t[i]))
        distances = model.condition(model.latents[i][None])(local[None])[0][samples.present[i]]
        for row in distances:
            (gradient,) = torch.autograd.grad(row.sum(), points, retain_graph=True)
            found.append(gradient.norm(dim=1))
    lengths = torch.cat(found)
    rank = max(1, round(QUANTILE * len(lengths)))
    return max(1.0, MARGIN * float(lengths.kthvalue(rank).values))
