"""One round of growth: the unexplained residual is decomposed, and parts are fitted to the pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.fields import kernel
from partwright.superfrusta.evidence import Evidence, Rows
from partwright.superfrusta.objective import occupancy_score
from partwright.superfrusta.refining import LIMITS, Stages, freedom, sharpened
from partwright.superfrusta.seeding import starts
from partwright.superfrusta.settings import Settings

_LEAST_DEPTH = 0.15  # voxels: thinner regions are noise (half a voxel would lose thin walls)
_LEAST_VOLUME = 2e-4  # of the shape
_LARGEST = 2  # connected pieces of the residual that are also seeded whole
_PLENTY = 3000  # samples that one part is fitted to
_SCREEN_EVERY = 3  # screening uses every third of them
_KEPT = 4  # starts that survive screening
_SCREEN = ((15.0, 5),)
_FIT = ((15.0, 4), (40.0, 10))

SampleSet = tuple[NDArray[np.int64], NDArray[np.float32]]


@dataclass(frozen=True)
class Region:
    """Voxels (X * Y * Z,) to explain, their depth, and how the fit looks at what surrounds them.

    `margin`: how far around the region samples count, as a share of its longest side. `elsewhere`: weight of
    unexplained inside samples outside the region. Explained ones weigh nothing: a part may run into them.
    """

    voxels: NDArray[np.bool_]
    depth: float
    margin: float
    elsewhere: float


def regions(evidence: Evidence, rows: Rows, settings: Settings) -> list[Region]:
    """Morphological decomposition of the residual max(S, -F), and its largest connected pieces whole."""
    grid = evidence.grid
    residual = np.maximum(grid.values, -evidence.grid_field(rows))
    least_depth, least = _LEAST_DEPTH * grid.spacing, _LEAST_VOLUME * evidence.inside_voxels
    labels, depths = kernel.decompose(
        residual, grid.spacing, settings.regions, settings.kappa, least_depth, least
    )
    found = []
    for label, depth in enumerate(depths):
        voxels = (labels == label).ravel()
        found += [Region(voxels, depth, 0.2, 0.15), Region(voxels, depth, 0.5, 1.0)]
    if len(depths) > 1:
        pieces, _ = ndimage.label(residual < -least_depth)
        sizes = np.bincount(pieces.ravel())
        sizes[0] = 0
        for piece in np.argsort(-sizes, kind="stable")[:_LARGEST]:
            if sizes[piece] > least:
                found.append(Region((pieces == piece).ravel(), float(np.median(depths)), 0.1, 0.3))
    return found


def grow(evidence: Evidence, rows: Rows, settings: Settings, most: int) -> Rows:
    """New rows, at most `most`, that raise the objective by more than their price; none when nothing does."""
    wanted = regions(evidence, rows, settings)
    if not wanted or most <= 0:
        return np.empty((0, 16), np.float32)
    field = evidence.field(rows)
    return _select(
        evidence, _fit_regions(evidence, field, wanted, settings), field < 0, settings.alpha / 2, most
    )


def _samples(evidence: Evidence, field: NDArray[np.float32], region: Region) -> SampleSet:
    """Sample indices around the region and their weights."""
    voxels = evidence.grid_points[region.voxels]
    low, high = voxels.min(axis=0), voxels.max(axis=0)
    margin = max(0.06, region.margin * float((high - low).max()))
    index = np.flatnonzero(((evidence.points > low - margin) & (evidence.points < high + margin)).all(axis=1))
    if len(index) > _PLENTY:
        index = index[np.linspace(0, len(index) - 1, _PLENTY).astype(np.int64)]
    weight = evidence.weight[index].copy()
    elsewhere = evidence.inside[index] & ~region.voxels[evidence.voxel[index]]
    weight[elsewhere] *= np.where(field[index][elsewhere] < 0, 0.0, region.elsewhere)
    return index, weight / max(float(weight.sum()), 1e-9)


def _fit_regions(
    evidence: Evidence, field: NDArray[np.float32], wanted: list[Region], settings: Settings
) -> Rows:
    """The best part for each region: all starts are screened briefly on few samples, the best go on."""
    sets = [_samples(evidence, field, region) for region in wanted]
    guesses = [starts(evidence.grid_points[region.voxels], evidence.grid.spacing) for region in wanted]
    owner = np.repeat(np.arange(len(wanted)), [len(g) for g in guesses])
    depth = float(np.median([region.depth for region in wanted]))
    screened, losses = _run(
        evidence, np.concatenate(guesses), owner, sets, _SCREEN_EVERY, _SCREEN, depth, settings
    )
    kept = np.concatenate([_best(losses, owner, i, _KEPT) for i in range(len(wanted))])
    fitted, losses = _run(evidence, screened[kept], owner[kept], sets, 1, _FIT, depth, settings)
    return fitted[np.concatenate([_best(losses, owner[kept], i, 1) for i in range(len(wanted))])]


def _best(
    losses: NDArray[np.float64], owner: NDArray[np.int64], region: int, count: int
) -> NDArray[np.int64]:
    mine = np.flatnonzero(owner == region)
    return mine[np.argsort(losses[mine], kind="stable")[:count]]


def _run(
    evidence: Evidence,
    rows: Rows,
    owner: NDArray[np.int64],
    sets: list[SampleSet],
    every: int,
    stages: Stages,
    depth: float,
    settings: Settings,
) -> tuple[Rows, NDArray[np.float64]]:
    """Single-part fits of all rows, each to every n-th sample of the set that `owner` names."""
    index = [s[0][::every] for s in sets]
    weight = [s[1][::every] for s in sets]
    ends = np.cumsum([len(i) for i in index])
    ranges = np.stack([ends - [len(i) for i in index], ends], axis=1)
    joined = np.concatenate(index)
    target = kernel.Target(evidence.points[joined], evidence.distance[joined], np.concatenate(weight))
    return kernel.fit_starts(
        rows, ranges[owner], target, sharpened(stages, depth), LIMITS,
        free=freedom(np.ones(len(rows), bool), settings), threads=settings.threads,
    )  # fmt: skip


def _select(
    evidence: Evidence, candidates: Rows, covered: NDArray[np.bool_], price: float, most: int
) -> Rows:
    """Greedy choice: whichever candidate raises R most joins, until none pays its price."""
    occupied = kernel.evaluate_parts(candidates, evidence.points, evidence.threads) < 0
    chosen: list[int] = []
    current = float(occupancy_score(evidence, covered))
    while len(chosen) < most:
        scores = occupancy_score(evidence, covered | occupied)
        best = int(scores.argmax())
        if scores[best] < current + price:
            break
        chosen.append(best)
        covered, current = covered | occupied[best], float(scores[best])
    return candidates[chosen]
