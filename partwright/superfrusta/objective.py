"""The objective that growing, pruning and stopping serve (SuperFrusta, eq. 1-2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.superfrusta.evidence import Evidence, Rows

_MISSED = 5.0  # in units of R per unit length


def occupancy_score(evidence: Evidence, occupied: NDArray[np.bool_]) -> NDArray[np.float64]:
    """R of occupancies (..., N) at the samples.

    R is the mean of two IoUs with the shape's occupancy: over the near-surface samples, each counted with
    its weight 1 + sigmoid(curvature), and over the uniform samples in and around the bounding box. The
    paper's R is the first alone; the second keeps deep, smooth volume from being given away.
    """
    weight, near = evidence.weight.astype(np.float64), evidence.near
    both = (occupied & evidence.inside) * weight
    either = (occupied | evidence.inside) * weight
    surface = both[..., :near].sum(-1) / np.maximum(either[..., :near].sum(-1), 1e-9)
    volume = both[..., near:].sum(-1) / np.maximum(either[..., near:].sum(-1), 1e-9)
    return np.asarray(0.5 * (surface + volume), dtype=np.float64)


def score(evidence: Evidence, rows: Rows) -> float:
    """R of an assembly."""
    return float(occupancy_score(evidence, evidence.field(rows) < 0))


def coverage(evidence: Evidence, rows: Rows) -> float:
    """R less the mean distance from inside samples to the assembly, times `_MISSED`.

    Where parts must go although none is worthless, R alone would rather drop a leg than thicken another part
    over it. A chair of few parts is a chair when every place of it is near some part.
    """
    field = evidence.field(rows)
    missed = float(np.maximum(field[evidence.inside], 0).mean())
    return float(occupancy_score(evidence, field < 0)) - _MISSED * missed


def volume_iou(evidence: Evidence, rows: Rows) -> float:
    """IoU over the uniform samples alone: an estimate of the grid IoU."""
    rest = slice(evidence.near, None)
    occupied, inside, weight = evidence.field(rows)[rest] < 0, evidence.inside[rest], evidence.weight[rest]
    return float(weight[occupied & inside].sum() / max(float(weight[occupied | inside].sum()), 1e-9))


def removal_scores(evidence: Evidence, rows: Rows) -> tuple[NDArray[np.float64], float]:
    """R (M,) of the assembly without each part, and R of the whole, from one pass over the samples."""
    ratios: list[NDArray[np.float64]] = []
    for part in (slice(None, evidence.near), slice(evidence.near, None)):
        counts = evidence.kernel.removal_counts(
            rows, evidence.points[part], evidence.inside[part], evidence.weight[part], evidence.threads
        )
        ratios.append(np.asarray(counts[:, 0] / np.maximum(counts[:, 1], 1e-9)))
    scores = 0.5 * (ratios[0] + ratios[1])
    return scores[:-1], float(scores[-1])
