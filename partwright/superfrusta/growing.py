"""One round of growth: the unexplained residual is decomposed, and parts are fitted to the pieces."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.at_once import at_once
from partwright.fields import kernel
from partwright.fields.columns import Column
from partwright.rows import corners
from partwright.superfrusta import solid_starts
from partwright.superfrusta.alike_regions import first_alike
from partwright.superfrusta.families import locked_values, with_locked_values
from partwright.superfrusta.initialisation import starts
from partwright.superfrusta.limits import LIMITS
from partwright.superfrusta.objective import occupancy_score
from partwright.superfrusta.refining import freedom, sharpened, ties
from partwright.superfrusta.repeat_candidates import distinct
from partwright.superfrusta.samples import NOTHING, FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.solid_kinds import plainness
from partwright.superfrusta.symmetric_fit import images

_LEAST_DEPTH = 0.15  # voxels: thinner regions are noise (half a voxel would lose thin walls)
_LEAST_VOLUME = 2e-4  # of the shape
_LARGEST = 2  # connected pieces of the residual that are also seeded whole
_BESIDE = 0.5  # voxels: of what is thinner than a voxel, those that lie no further from it are taken for it
_TOUCHING = np.ones((3, 3, 3))  # thin pieces hold together by edges and corners of voxels, too
_PRICE_DIVISOR = 3  # of a part's price while growing: the thinning finds what is worth the whole
_MOST_SAMPLES = 3000  # samples that one part is fitted to
_SCREEN_EVERY = 3  # screening uses every third of them
_SCREENED_STARTS = 4  # starts that survive screening
_CARVABLE_WEIGHT = 0.1  # weight of too much where it can be carved away again
_SCREEN = ((15.0, 5),)
_FIT = ((15.0, 4), (40.0, 10))


@dataclass(frozen=True)
class Region:
    """Voxels (X * Y * Z,) to explain with one part, beside parts `others` that stay.

    depth: of the erosion. margin: how far around the region samples count, as a share of its longest side.
    elsewhere: weight of samples outside the region that the others do not explain either. frames: rotations
    (w, x, y, z) to start from beside the principal axes. sign: +1 for a part to add where the shape is
    missed, -1 for one to subtract where too much is covered. under: the part goes before those that are
    subtracted, so that it may run through them. hull: planes (K, 4) of a convex hull in which covering too
    much costs little.
    """

    voxels: NDArray[np.bool_]
    others: Rows
    depth: float
    margin: float
    elsewhere: float
    frames: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 4), np.float32))
    sign: float = 1.0
    under: bool = False
    hull: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Grown:
    """New rows: `first` go before all that move, so that cuts reach them too, `last` to the end."""

    first: Rows
    last: Rows

    def __len__(self) -> int:
        return len(self.first) + len(self.last)

    def joined(self, rows: Rows, locked: int) -> Rows:
        return np.concatenate([rows[:locked], self.first, rows[locked:], self.last])


@dataclass(frozen=True)
class View:
    """The samples that a region's part is fitted to: indices, weights, distance of the other parts."""

    index: NDArray[np.int64]
    weight: NDArray[np.float32]
    background: NDArray[np.float32]


def regions(samples: FitSamples, rows: Rows, settings: Settings) -> list[Region]:
    """Pieces of the residual max(S, -F), to add, and, where settings allow, of max(F, -S), to subtract."""
    field = samples.grid_field(rows)
    jobs = [partial(_pieces, samples, samples.grid.values, field, rows, settings, 1.0)]
    if settings.subtract and len(rows):
        jobs.append(partial(_excess, samples, field, rows, settings))
    return [one for found in at_once(jobs, samples.threads) for one in found]


def _excess(samples: FitSamples, field: NDArray[np.float32], rows: Rows, settings: Settings) -> list[Region]:
    return _pieces(samples, field, samples.grid.values, rows, settings, -1.0)


def _pieces(
    samples: FitSamples,
    wanted: NDArray[np.float32],
    found: NDArray[np.float32],
    rows: Rows,
    settings: Settings,
    sign: float,
) -> list[Region]:
    """Of what is inside by one field (X, Y, Z) and not by another: the morphological decomposition, and the
    largest connected pieces whole.

    Of a ring or a skin thinner than a voxel the residual holds voxels here and there. It is whole where the
    fields differ, which they do by its thickness, across it and beside it.
    """
    grid = samples.grid
    residual = np.maximum(wanted, -found)
    carved = sign > 0 and bool((rows[:, Column.SIGN] < 0).any())
    least_depth, least = _LEAST_DEPTH * grid.spacing, _LEAST_VOLUME * samples.inside_voxels
    labels, depths = samples.kernel.decompose(
        residual, grid.spacing, settings.regions, settings.kappa, least_depth, least
    )
    pieces = []
    for label, depth in enumerate(depths):
        voxels = (labels == label).ravel()
        pieces.append(Region(voxels, rows, depth, 0.2, 0.15, sign=sign))
        pieces.append(Region(voxels, rows, depth, 0.5, 1.0, sign=sign, under=carved))
    whole = []
    if len(rows):
        thin = (found - wanted > least_depth) & (residual < _BESIDE * grid.spacing)
        whole += _largest(thin, _TOUCHING, 1, least)
    if len(depths) > 1:
        whole += _largest(residual < -least_depth, None, _LARGEST, least)
    depth = float(np.median(depths)) if len(depths) else _BESIDE * grid.spacing
    return pieces + [Region(voxels, rows, depth, 0.1, 0.3, sign=sign) for voxels in whole]


def _largest(
    voxels: NDArray[np.bool_], touching: NDArray[np.float64] | None, count: int, least: float
) -> list[NDArray[np.bool_]]:
    """Voxels (X * Y * Z,) of the largest connected pieces, if they are of more than the least size."""
    if np.count_nonzero(voxels) <= least:
        return []
    ends = [np.flatnonzero(voxels.any(axis=tuple({0, 1, 2} - {axis})))[[0, -1]] for axis in range(3)]
    box = tuple(slice(first, last + 1) for first, last in ends)
    pieces, _ = ndimage.label(voxels[box], touching)
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    order = np.argsort(-sizes, kind="stable")[:count]
    found = []
    for piece in order[sizes[order] > least]:
        whole = np.zeros(voxels.shape, bool)
        whole[box] = pieces == piece
        found.append(whole.ravel())
    return found


def grow(samples: FitSamples, rows: Rows, settings: Settings, most: int) -> Grown:
    """New rows, at most `most`, that raise the objective by more than their price; none when nothing does."""
    return _grown(samples, regions(samples, rows, settings), rows, settings, most)


def carve(samples: FitSamples, rows: Rows, settings: Settings, most: int) -> Grown:
    """The same for parts to subtract: holes and slots that what is there covers."""
    wanted = _excess(samples, samples.grid_field(rows), rows, settings)
    return _grown(samples, wanted, rows, settings, most)


def _grown(samples: FitSamples, wanted: list[Region], rows: Rows, settings: Settings, most: int) -> Grown:
    if not wanted or most <= 0:
        return Grown(NOTHING, NOTHING)
    if len(rows):  # of two halves of the whole shape either may be what tells how it bends
        wanted = _unlike(samples, wanted)
    field = samples.field(rows)  # which all regions are fitted beside
    candidates = fit_regions(samples, wanted, settings)
    return _select(samples, candidates, rows, field < 0, settings.price / _PRICE_DIVISOR, most)


def _unlike(samples: FitSamples, wanted: list[Region]) -> list[Region]:
    """Without regions that are images of others: what is fitted to those is tried in place of these, too."""
    if not samples.images:
        return wanted
    by_voxels = {(id(region.voxels), region.sign): region for region in wanted}
    first = first_alike(samples, [(region.voxels, region.sign) for region in by_voxels.values()])
    kept = {key for index, key in enumerate(by_voxels) if first[index] == index}
    return [region for region in wanted if (id(region.voxels), region.sign) in kept]


def _view(samples: FitSamples, region: Region, points: NDArray[np.float32]) -> View:
    """points: (n, 3) the region's voxels."""
    low, high = corners(points)
    margin = max(0.06, region.margin * float((high - low).max()))
    index = samples.within(low - margin, high + margin)
    if len(index) > _MOST_SAMPLES:
        index = index[np.linspace(0, len(index) - 1, _MOST_SAMPLES).astype(np.int64)]
    index = np.concatenate([index, samples.far_indices])
    background = samples.field_at(region.others, index)
    weight = samples.weight[index].copy()
    wrong = (background < 0) != samples.inside[index]
    missed = samples.inside[index] if region.sign > 0 else ~samples.inside[index]
    weight[wrong & missed & ~region.voxels[samples.voxel[index]]] *= region.elsewhere
    if region.under:
        cuts = region.others[region.others[:, Column.SIGN] < 0]
        weight[samples.covered_by(cuts, samples.points[index]).any(axis=0)] = 0
    if region.hull is not None:
        within = (samples.points[index] @ region.hull[:, :3].T + region.hull[:, 3] < 0).all(axis=1)
        weight[within & ~samples.inside[index]] *= _CARVABLE_WEIGHT
    return View(index, weight / max(float(weight.sum()), 1e-9), background)


def fit_regions(samples: FitSamples, wanted: list[Region], settings: Settings, overlap: float = 0.0) -> Rows:
    """The best part for each region."""
    fitted, owner, losses = finalists(samples, wanted, settings, overlap)
    if settings.family == "solid":
        losses = losses * plainness(fitted)
    return fitted[np.concatenate([_best(losses, owner, i, 1) for i in range(len(wanted))])]


def finalists(
    samples: FitSamples, wanted: list[Region], settings: Settings, overlap: float = 0.0
) -> tuple[Rows, NDArray[np.int64], NDArray[np.float64]]:
    """Some parts fitted to each region, the regions that they are for, and their losses.

    All starts are screened briefly on few samples, and the best go on. `overlap` is the price of running into
    the other parts. Growth asks none: a new part that may not cross what is there gets stuck in its region.
    """
    # Regions of the same voxels, which differ in what they count around them, go on from the same starts, the
    # best for the first of them: others are hardly better.
    first = {id(region.voxels): i for i, region in reversed([*enumerate(wanted)])}
    points = {key: samples.grid_points[np.flatnonzero(wanted[i].voxels)] for key, i in first.items()}
    looks = [partial(_view, samples, region, points[id(region.voxels)]) for region in wanted]
    guessing = [partial(_guesses, samples, wanted[i], points[key], settings) for key, i in first.items()]
    views, guesses = at_once(looks, samples.threads), at_once(guessing, samples.threads)
    owner = np.repeat(list(first.values()), [len(g) for g in guesses])
    depth = float(np.median([region.depth for region in wanted]))
    rows = np.concatenate(guesses)
    stages = sharpened(_SCREEN, depth)
    screened, losses = _run(samples, rows, owner, views, _SCREEN_EVERY, stages, overlap, settings)
    kept = np.concatenate([_best(losses, owner, i, _SCREENED_STARTS) for i in first.values()])
    rows, owner = screened[kept], owner[kept]
    mine = [np.flatnonzero(owner == first[id(region.voxels)]) for region in wanted]
    rows, owner = rows[np.concatenate(mine)], np.repeat(np.arange(len(wanted)), [len(one) for one in mine])
    fitted, losses = _run(samples, rows, owner, views, 1, sharpened(_FIT, depth), overlap, settings)
    # A thin part that shoots out of the shape passes between the few samples out there.
    astray = samples.stray_weight(fitted) * (fitted[:, Column.SIGN] > 0)
    losses += astray / np.array([len(view.index) for view in views])[owner]
    return fitted, owner, losses


def _guesses(samples: FitSamples, region: Region, points: NDArray[np.float32], settings: Settings) -> Rows:
    spacing = samples.grid.spacing
    if settings.family == "solid":
        return solid_starts.starts(points, spacing, region.sign, region.frames)
    rows = with_locked_values(
        starts(points, spacing, region.frames), locked_values(settings.family, settings.smooth)
    )
    rows[:, Column.SIGN] = region.sign
    return rows


def _best(
    losses: NDArray[np.float64], owner: NDArray[np.int64], region: int, count: int
) -> NDArray[np.int64]:
    mine = np.flatnonzero(owner == region)
    return mine[np.argsort(losses[mine], kind="stable")[:count]]


def _run(
    samples: FitSamples,
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
        samples.points[index],
        samples.distance[index],
        np.concatenate([view.weight[::every] for view in views]),
        np.concatenate([view.background[::every] for view in views]),
    )
    return samples.kernel.fit_starts(
        rows,
        np.stack([ends - counts, ends], axis=1)[owner],
        target,
        stages,
        LIMITS,
        free=freedom(rows, np.ones(len(rows), bool), settings),
        tied=ties(rows, settings),
        penalties=kernel.Penalties(overlap=overlap),
        threads=samples.threads,
    )


def _select(
    samples: FitSamples, candidates: Rows, rows: Rows, covered: NDArray[np.bool_], price: float, most: int
) -> Grown:
    """Greedy choice beside rows that cover samples (N,): whichever candidate raises R most joins, until none
    pays its price, or `most` have joined.

    What is added may join before the parts that are subtracted, or after them. Images of what has joined,
    under the symmetries of the shape, are candidates, too, and do not count among those.
    """
    fitted, left = len(candidates), most
    occupied = samples.covered_by(candidates, samples.points)
    cuts = rows[rows[:, Column.SIGN] < 0]
    carved = samples.covered_by(cuts, samples.points).any(axis=0) if len(cuts) else None
    chosen: list[tuple[bool, int]] = []
    current = float(occupancy_score(samples, covered))
    while (first_open := 0 if left else fitted) < len(candidates):
        some, added = occupied[first_open:], candidates[first_open:, Column.SIGN, None] > 0
        more = covered | some
        ways = {False: more if added.all() else np.where(added, more, covered > some)}
        if carved is not None:
            ways[True] = np.where(added, covered | (some > carved), covered)
        scores = {under: occupancy_score(samples, way) for under, way in ways.items()}
        under = max(scores, key=lambda u: (float(scores[u].max()), u))
        which = int(scores[under].argmax())
        if scores[under][which] < current + price:
            break
        best = first_open + which
        chosen.append((under, best))
        covered, current = ways[under][which], float(scores[under][which])
        if carved is not None and not added[which, 0]:
            carved = carved | occupied[best]
        left -= best < fitted
        if best < fitted and samples.images:
            others = images(candidates[[best]], samples.images)[:, 0]
            there = samples.covered_by(others, samples.points)
            elsewhere = distinct(occupied[best], there)
            candidates = np.concatenate([candidates, others[elsewhere]])
            occupied = np.concatenate([occupied, there[elsewhere]])
    first, last = ([i for u, i in chosen if u is under] for under in (True, False))
    return Grown(candidates[first], candidates[last])
