"""How far latents are from those of the training (kNN, Remelli et al. 2020; PartSDF, appendix D)."""

from __future__ import annotations

from typing import Any

import numpy as np

from partwright.goals.entry import LATENT
from partwright.goals.parameters import Parameters

_NEIGHBOURS = 8
_BEYOND = 1.5  # times the farthest that a training shape is from its neighbours: outside of the region


class TrainedRegion:
    """For each learned part: the training's latents, and how far these are from one another.

    Distances are root mean squares over the nearest neighbours, as a share of the largest among the training
    shapes themselves.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.parts: list[tuple[slice, np.ndarray, float]] = []
        for i, entries in enumerate(parameters.entries):
            places = [k for k, entry in enumerate(entries) if entry.group == LATENT]
            if not places:
                continue
            field: Any = parameters.assembly.parts[i].field
            index = field.network.index(field.part)
            known = field.network.latents[field.network.present[:, index], index].double().numpy()
            first = parameters.slices[i].start + places[0]
            apart = [_nearest(np.delete(known, k, 0), z)[1] for k, z in enumerate(known)]
            farthest = max(apart, default=0.0) or 1.0
            self.parts.append((slice(first, first + len(places)), known, farthest))

    def measure(self, values: np.ndarray) -> tuple[float, np.ndarray]:
        """Mean over parts of the squared distance to neighbours, and its derivative (D,) by the values."""
        total, slope = 0.0, np.zeros_like(values)
        for own, known, farthest in self.parts:
            near, apart = _nearest(known, values[own])
            total += (apart / farthest) ** 2
            slope[own] += 2 * (values[own] - near.mean(axis=0)) / farthest**2
        count = max(1, len(self.parts))
        return total / count, slope / count

    def outside(self, values: np.ndarray) -> float:
        """The largest distance over what counts as inside; above 1 is outside."""
        shares = [_nearest(known, values[own])[1] / (_BEYOND * far) for own, known, far in self.parts]
        return max(shares, default=0.0)


def _nearest(known: np.ndarray, latent: np.ndarray) -> tuple[np.ndarray, float]:
    square = ((known - latent) ** 2).sum(axis=1)
    few = np.argsort(square, kind="stable")[:_NEIGHBOURS]
    return known[few], float(np.sqrt(square[few].mean())) if len(few) else 0.0
