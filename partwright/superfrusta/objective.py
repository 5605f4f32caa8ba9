"""The objective that growing, pruning and stopping serve (SuperFrusta, eq. 1-2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.fields import kernel
from partwright.superfrusta.samples import FitSamples, Rows

_MISSED = 5.0  # in units of R per unit length


def occupancy_score(samples: FitSamples, occupied: NDArray[np.bool_]) -> NDArray[np.float64]:
    """R of occupancies (..., N) at the samples.

    R is the mean of two IoUs with the shape's occupancy: over the near-surface samples, each counted with
    its weight 1 + sigmoid(curvature), and over the uniform samples in and around the bounding box. The
    paper's R is the first alone; the second keeps deep, smooth volume from being given away.
    """
    flat = occupied.reshape(-1, occupied.shape[-1])
    sums = kernel.occupancy_sums(flat, samples.inside, samples.weight, samples.near, samples.threads)
    ious = sums[..., 0] / np.maximum(sums[..., 1], 1e-9)
    return ious.mean(axis=1).reshape(occupied.shape[:-1])


def score(samples: FitSamples, rows: Rows) -> float:
    """R of an assembly."""
    return float(occupancy_score(samples, samples.field(rows) < 0))


def coverage(samples: FitSamples, rows: Rows) -> float:
    """R less the mean distance from inside samples to the assembly, times `_MISSED`.

    Where parts must go although none is worthless, R alone would rather drop a leg than thicken another part
    over it. A chair of few parts is a chair when every place of it is near some part.
    """
    field = samples.field(rows)
    missed = float(np.maximum(field[samples.inside], 0).mean())
    return float(occupancy_score(samples, field < 0)) - _MISSED * missed


def volume_iou(samples: FitSamples, rows: Rows) -> float:
    """IoU over the uniform samples alone: an estimate of the grid IoU."""
    rest = slice(samples.near, None)
    occupied, inside, weight = samples.field(rows)[rest] < 0, samples.inside[rest], samples.weight[rest]
    return float(weight[occupied & inside].sum() / max(float(weight[occupied | inside].sum()), 1e-9))


def removal_scores(samples: FitSamples, rows: Rows) -> tuple[NDArray[np.float64], float]:
    """R (M,) of the assembly without each part, and R of the whole, from one pass over the samples."""
    ratios: list[NDArray[np.float64]] = []
    for part in (slice(None, samples.near), slice(samples.near, None)):
        counts = samples.kernel.removal_counts(
            rows, samples.points[part], samples.inside[part], samples.weight[part], samples.threads
        )
        ratios.append(np.asarray(counts[:, 0] / np.maximum(counts[:, 1], 1e-9)))
    scores = 0.5 * (ratios[0] + ratios[1])
    return scores[:-1], float(scores[-1])
