"""How well a shape made of parts was reconstructed: the measures of PartSDF's tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import product

import numpy as np
from numpy.typing import NDArray

from partwright.metrics import chamfer
from partwright.metrics.image_consistency import image_consistency
from partwright.metrics.parted import (
    RESOLUTION,
    PartedSurface,
    joint_box,
    owners_in,
    part_iou,
    undecided,
    whole_iou,
)
from partwright.render.raycast import Scene
from partwright.shapes.sampling import sample_triangles


@dataclass(frozen=True)
class ReconstructionScores:
    """A row of PartSDF's Table 1, for one shape or as means over several; unit frame.

    chamfer: to be shown x 1e4; chamfer_floor: what two samples of the truth score against each other. iou
    and part_iou: 0 to 1, over the joint bounding box. decided_part_iou: the same without cells of the truth
    that two of its parts are as near to (`parted.undecided`), which the paper counts, too: a perfect mesh
    scores 1 by this. image_consistency: up to 1. failed: share of shapes of which nothing came out.
    """

    chamfer: float
    chamfer_floor: float
    iou: float
    image_consistency: float
    part_iou: float
    decided_part_iou: float
    failed: float


def reconstruction_scores(
    result: PartedSurface | None, truth: PartedSurface, seed: int = 0
) -> ReconstructionScores:
    """Measure a reconstruction, None or without faces where it failed, against the true surface (B.6).

    A failure counts as the worst: no IoU, no consistency, and the Chamfer distance of a surface that has
    shrunk to the corner of [-1, 1]^3 where it is largest.
    """
    seeds = [int(s) for s in np.random.SeedSequence(seed).generate_state(3)]
    target, again = (_sampled(truth, s) for s in seeds[:2])
    floor = chamfer.chamfer(again, target)
    if result is None or len(result.faces) == 0:
        return ReconstructionScores(worst_chamfer(target), floor, 0.0, 0.0, 0.0, 0.0, 1.0)
    box = joint_box(result, truth)
    found, true = (owners_in(surface, *box, RESOLUTION) for surface in (result, truth))
    decided = ~undecided(truth, true, *box)
    return ReconstructionScores(
        chamfer=chamfer.chamfer(_sampled(result, seeds[2]), target),
        chamfer_floor=floor,
        iou=whole_iou(found, true),
        image_consistency=image_consistency(
            Scene(result.vertices, result.faces), Scene(truth.vertices, truth.faces)
        ),
        part_iou=part_iou(found, true),
        decided_part_iou=part_iou(found[decided], true[decided]),
        failed=0.0,
    )


def worst_chamfer(target: NDArray[np.float64]) -> float:
    """Chamfer distance between points (N, 3) and the corner of [-1, 1]^3 that is farthest by it."""
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    return max(chamfer.chamfer(corner[None], target) for corner in corners)


def mean_scores(scores: Sequence[ReconstructionScores]) -> ReconstructionScores:
    """The mean of each measure over at least one shape, failures included."""
    means = {
        f.name: float(np.mean([getattr(s, f.name) for s in scores])) for f in fields(ReconstructionScores)
    }
    return ReconstructionScores(**means)


def _sampled(surface: PartedSurface, seed: int) -> NDArray[np.float64]:
    vertices = np.asarray(surface.vertices, dtype=np.float64)
    return sample_triangles(vertices, np.asarray(surface.faces, dtype=np.int64), chamfer.COUNT, seed)[0]
