"""Parts that are found where the shape has none, as arms of a chair that stands without them.

Most samples lie near the shape's surface, so that a part out in the air is hardly seen by them: it keeps what
little it explains. Here the shape is asked at places within each found part, too; a part without which the
whole is closer, at these and at the samples, is not there.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from partwright.partsdf.losses import aggregate, clamped_error
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.targets import Target

_SAMPLES = 8192  # of the target's
_PLACES = 2000  # in each part's cuboid


@torch.no_grad()
def needed(shape: NeuralShape, target: Target) -> Tensor:
    """(P,) which of the parts that are there the target needs: of those that reach out into the air, the one
    without which the error is the least is left out, in turn, for as long as the error falls by that.

    All are, where points are all that is known of the target: these do not tell where air is."""
    if target.shape is None:
        return shape.present
    places = np.concatenate([shape.places(name, _PLACES) for name in shape.names()])
    found = shape.part_distances(places)
    within = found.min(axis=0) < 0
    places, found = places[within], found[:, within]
    away = target.distances(places)
    air = away > shape.model.config.losses.clamp  # whence no sample's error pulls a part back
    reaching = set(np.flatnonzero((found[:, air] < 0).any(axis=1)).tolist())
    if not reaching:
        return shape.present
    rows = torch.linspace(0, len(target.sdf) - 1, min(_SAMPLES, len(target.sdf))).long()
    each = torch.from_numpy(
        np.concatenate([shape.part_distances(target.points[rows].numpy()), found[:, air]], axis=1)
    )
    known = torch.cat([target.sdf[rows], torch.from_numpy(away[air])])

    def error(parts: set[int]) -> float:
        whole = aggregate(each[None, sorted(parts)], shape.model.config.decoder)[0]
        return float(clamped_error(whole, known, shape.model.config.losses).mean())

    parts = set(range(len(each)))
    best = error(parts)
    while len(parts) > 1 and reaching & parts:
        least, part = min((error(parts - {one}), one) for one in reaching & parts)
        if least >= best:
            break
        best = least
        parts.remove(part)
    present = shape.present.clone()
    there = present.nonzero().squeeze(1)
    present[there] = torch.tensor([i in parts for i in range(len(there))])
    return present
