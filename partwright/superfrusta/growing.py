"""One round of growth: the unexplained residual is decomposed, and parts are fitted to the pieces."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.fields import kernel
from partwright.superfrusta.evidence import Evidence, Rows
from partwright.superfrusta.families import held, held_down
from partwright.superfrusta.objective import occupancy_score
from partwright.superfrusta.refining import LIMITS, freedom, sharpened
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


@dataclass(frozen=True)
class Region:
    """Voxels (X * Y * Z,) to explain with one part, beside parts `others` that stay.

    depth: of the erosion. margin: how far around the region samples count, as a share of its longest side.
    elsewhere: weight of inside samples outside the region that no part explains yet. frames: rotations (w, x,
    y, z) to start from beside the principal axes.
    """

    voxels: NDArray[np.bool_]
    others: Rows
    depth: float
    margin: float
    elsewhere: float
    frames: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 4), np.float32))


@dataclass(frozen=True)
class View:
    """The samples that a region's part is fitted to: indices, weights, distance of the other parts."""

    index: NDArray[np.int64]
    weight: NDArray[np.float32]
    background: NDArray[np.float32]


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
        found += [Region(voxels, rows, depth, 0.2, 0.15), Region(voxels, rows, depth, 0.5, 1.0)]
    if len(depths) > 1:
        pieces, _ = ndimage.label(residual < -least_depth)
        sizes = np.bincount(pieces.ravel())
        sizes[0] = 0
        for piece in np.argsort(-sizes, kind="stable")[:_LARGEST]:
            if sizes[piece] > least:
                found.append(Region((pieces == piece).ravel(), rows, float(np.median(depths)), 0.1, 0.3))
    return found


def grow(evidence: Evidence, rows: Rows, settings: Settings, most: int) -> Rows:
    """New rows, at most `most`, that raise the objective by more than their price; none when nothing does."""
    wanted = regions(evidence, rows, settings)
    if not wanted or most <= 0:
        return np.empty((0, 16), np.float32)
    candidates = fit_regions(evidence, wanted, settings)
    return _select(evidence, candidates, evidence.field(rows) < 0, settings.price / 2, most)


def _view(evidence: Evidence, region: Region) -> View:
    voxels = evidence.grid_points[region.voxels]
    low, high = voxels.min(axis=0), voxels.max(axis=0)
    margin = max(0.06, region.margin * float((high - low).max()))
    index = np.flatnonzero(((evidence.points > low - margin) & (evidence.points < high + margin)).all(axis=1))
    if len(index) > _PLENTY:
        index = index[np.linspace(0, len(index) - 1, _PLENTY).astype(np.int64)]
    index = np.concatenate([index, evidence.outskirts])
    background = evidence.distance_of(region.others, evidence.points[index])
    weight = evidence.weight[index].copy()
    unexplained = evidence.inside[index] & ~region.voxels[evidence.voxel[index]] & (background > 0)
    weight[unexplained] *= region.elsewhere
    return View(index, weight / max(float(weight.sum()), 1e-9), background)


def fit_regions(evidence: Evidence, wanted: list[Region], settings: Settings, overlap: float = 0.0) -> Rows:
    """The best part for each region: all starts are screened briefly on few samples, the best go on.

    `overlap` is the price of running into the other parts. Growth asks none: a new part that may not cross
    what is there gets stuck in its region.
    """
    views = [_view(evidence, region) for region in wanted]
    spacing = evidence.grid.spacing
    values = held(settings.family, settings.smooth)
    guesses = [
        held_down(starts(evidence.grid_points[region.voxels], spacing, region.frames), values)
        for region in wanted
    ]
    owner = np.repeat(np.arange(len(wanted)), [len(g) for g in guesses])
    depth = float(np.median([region.depth for region in wanted]))
    screened, losses = _run(
        evidence,
        np.concatenate(guesses),
        owner,
        views,
        _SCREEN_EVERY,
        sharpened(_SCREEN, depth),
        overlap,
        settings,
    )
    kept = np.concatenate([_best(losses, owner, i, _KEPT) for i in range(len(wanted))])
    fitted, losses = _run(
        evidence, screened[kept], owner[kept], views, 1, sharpened(_FIT, depth), overlap, settings
    )
    # A thin part that shoots out of the shape passes between the few samples out there.
    losses += evidence.astray(fitted) / np.array([len(view.index) for view in views])[owner[kept]]
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
    views: list[View],
    every: int,
    stages: NDArray[np.float32],
    overlap: float,
    settings: Settings,
) -> tuple[Rows, NDArray[np.float64]]:
    """Single-part fits of all rows, each to every n-th sample of the view that `owner` names."""
    index = np.concatenate([view.index[::every] for view in views])
    counts = np.array([len(view.index[::every]) for view in views])
    ends = np.cumsum(counts)
    target = kernel.Target(
        evidence.points[index],
        evidence.distance[index],
        np.concatenate([view.weight[::every] for view in views]),
        np.concatenate([view.background[::every] for view in views]),
    )
    return evidence.kernel.fit_starts(
        rows,
        np.stack([ends - counts, ends], axis=1)[owner],
        target,
        stages,
        LIMITS,
        free=freedom(np.ones(len(rows), bool), settings),
        penalties=kernel.Penalties(overlap=overlap),
        threads=settings.threads,
    )


def _select(
    evidence: Evidence, candidates: Rows, covered: NDArray[np.bool_], price: float, most: int
) -> Rows:
    """Greedy choice: whichever candidate raises R most joins, until none pays its price."""
    occupied = evidence.parts_of(candidates, evidence.points) < 0
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
