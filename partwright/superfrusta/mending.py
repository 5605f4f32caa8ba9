"""Mending what an eye sees: parts that stick out of the shape, and places that none reaches.

Optimisation and search serve overlaps, which hardly feel either. Here the part that is furthest off is moved,
fitted anew, split, joined by another or taken away, whichever serves an objective best that feels both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from partwright.fields.columns import ROTATION
from partwright.fields.kernel import Target
from partwright.superfrusta.deviations import Deviations, deviations
from partwright.superfrusta.growing import Region, finalists, grow
from partwright.superfrusta.merging import owners
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.pruning import cheapest_removal, neighbours
from partwright.superfrusta.refining import POLISH, TOUCH_UP, Stages, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

Mask = NDArray[np.bool_]
Valued = tuple[float, Rows]  # an assembly and its objective

_ENOUGH = 0.018  # unit lengths, a hundredth of the longest side: what is nearer is not mended
_FAR = 0.045  # unit lengths off from which on a part makes room for several
_REGROWN = 3  # at most
_TWICE = 0.02  # unit lengths off at which a sample weighs twice
_HEAVIEST = 25.0  # times that a sample may weigh
_SAME_PLACE = 0.02  # unit lengths
_STAGES: Stages = ((40.0, 4), (100.0, 5))
_HOPELESS = 0.02  # of the objective: what is so much worse after a refit goes no further
_REFITTED = 2  # of the ways to change a part
_BEST_STARTS = 2  # parts for one region that are tried
_LEAST_HALVED = 100  # voxels


@dataclass(frozen=True)
class Mending:
    """Mends an assembly of parts that are all added.

    locked: parts that come first and stay. told: the assembly after each improvement.
    """

    samples: FitSamples
    settings: Settings
    locked: int = 0
    told: Callable[[Rows], None] | None = None

    def __call__(self, rows: Rows) -> Rows:
        """Rows (M, 17) after at most `settings.mends` tries, without parts that no longer pay."""
        best, off = rows, deviations(self.samples, rows)
        reached = self.objective(rows, off)
        given_up: list[NDArray[np.float32]] = []
        part: int | None = None
        for _ in range(self.settings.mends + 1):
            if part is None:
                trials = self.moved(best, np.ones(len(best), bool), reached)
            else:
                trials = self.ways(best, part, off, reached)
            allowed = ((now, trial) for now, trial in trials if self.allowed(trial, rows))
            now, trial = max(allowed, key=lambda one: one[0], default=(-np.inf, best))
            if now > reached:
                best, reached, off = trial, now, deviations(self.samples, trial)
                if self.told is not None:
                    self.told(best)
            elif part is not None:
                given_up.append(off.points[off.worst(part)])
            part = _next(off, given_up)
            if part is None:
                break
        slim = self.slimmed(best, reached)
        polished = refine(self.samples, slim, POLISH, self.settings, np.arange(len(slim)) >= self.locked)
        better = self.objective(polished) > self.objective(slim) and self.allowed(polished, slim)
        return polished if better else slim

    def objective(self, rows: Rows, off: Deviations | None = None) -> float:
        """Eq. 2 with a price on how far off the parts are."""
        off = off or deviations(self.samples, rows)
        return score(self.samples, rows) - self.settings.alpha * len(rows) - self.settings.firmness * off.norm

    def allowed(self, trial: Rows, given: Rows) -> bool:
        """Whether a part budget or a target, which thinning has met, still holds."""
        settings = self.settings
        if settings.max_parts is not None and len(trial) > max(settings.max_parts, len(given)):
            return False
        if settings.min_iou is None:
            return True
        least = min(settings.min_iou, volume_iou(self.samples, given))
        return len(trial) <= len(given) and volume_iou(self.samples, trial) >= least

    def slimmed(self, rows: Rows, reached: float) -> Rows:
        """Without the parts that do not pay for themselves any more."""
        while len(rows) > max(1, self.locked):
            thinned, now, _ = cheapest_removal(
                self.samples, rows, self.settings, self.locked, lambda _, trial: self.objective(trial)
            )
            if now < reached or not self.allowed(thinned, rows):
                break
            rows, reached = thinned, now
        return rows

    def ways(self, rows: Rows, part: int, off: Deviations, reached: float) -> Iterator[Valued]:
        """Assemblies that may be better: part and neighbours moved, the most promising changes refitted."""
        moving = neighbours(self.samples, rows, part)
        moving[part] = True
        yield from self.moved(rows, moving, reached)
        if part < self.locked:
            return
        changes = [(self.objective(trial), trial, new) for trial, new in self.changes(rows, part, off)]
        for value, trial, new in sorted(changes, key=lambda one: -one[0])[:_REFITTED]:
            yield value, trial
            yield from self.moved(trial, np.append(np.delete(moving, part), np.ones(new, bool)), reached)

    def moved(self, rows: Rows, moving: Mask, reached: float) -> Iterator[Valued]:
        """The parts moved to where they explain the most, and on to where they are nowhere far off."""
        moving = moving & (np.arange(len(rows)) >= self.locked)
        plain = refine(self.samples, rows, TOUCH_UP, self.settings, moving)
        value = self.objective(plain)
        yield value, plain
        if value > reached - _HOPELESS:
            near = refine(self.samples, plain, _STAGES, self.settings, moving, self.target(plain, moving))
            yield self.objective(near), near

    def target(self, rows: Rows, moving: Mask) -> Target:
        """Samples that weigh by how far off they are, and the points where moving parts are off."""
        samples = self.samples
        index = samples.optimised_indices
        distance, field = samples.distance[index], samples.distance_of(rows, samples.points[index])
        off = np.where(
            (field < 0) & (distance > 0), distance, np.where(distance < 0, np.maximum(field, 0), 0)
        )
        apart = deviations(samples, rows)
        mine = moving[apart.part]
        weight = np.concatenate([samples.weight[index] * (1 + _emphasis(off)), _emphasis(apart.off[mine])])
        return Target(
            np.concatenate([samples.points[index], apart.points[mine]]),
            np.concatenate([distance, apart.distance[mine]]),
            (weight / weight.sum()).astype(np.float32),
        )

    def changes(self, rows: Rows, part: int, off: Deviations) -> Iterator[tuple[Rows, int]]:
        """Assemblies before any refit, and how many of their last parts are new."""
        samples, worst = self.samples, off.worst(part)
        others = np.delete(rows, part, axis=0)
        if len(others):
            yield others, 0
        mine = owners(samples, rows) == part
        if mine.any():
            for one in self.fitted(mine, others, rows[part]):
                yield np.concatenate([others, one[None]]), 1
        if off.off[worst] > _FAR:
            grown = grow(samples, others, self.settings, _REGROWN)
            if len(grown):
                yield grown.joined(others, self.locked), len(grown.last)
        missed = self.missed(rows, off.points[worst]) if off.distance[worst] <= 0 else None
        if missed is not None:
            for one in self.fitted(missed, rows, rows[part]):
                yield np.concatenate([others, rows[[part]], one[None]]), 2
        if np.count_nonzero(mine) > _LEAST_HALVED:
            halves = [self.fitted(half, others, rows[part])[0] for half in _halves(samples, mine)]
            yield np.concatenate([others, halves]), 2

    def fitted(self, voxels: Mask, others: Rows, like: NDArray[np.float32]) -> Rows:
        """The best few parts for the voxels, beside the others; `like` gives a frame to start from."""
        depth = float(np.abs(self.samples.grid.values.ravel()[voxels]).max())
        region = Region(voxels, others, depth, margin=0.2, elsewhere=0.3, frames=like[None, ROTATION])
        found, _, losses = finalists(self.samples, [region], self.settings, self.settings.overlap)
        return found[np.argsort(losses, kind="stable")[:_BEST_STARTS]]

    def missed(self, rows: Rows, place: NDArray[np.float32]) -> Mask | None:
        """The connected voxels inside the shape, about a place, that no part covers."""
        grid = self.samples.grid
        open_ = (grid.values < 0) & (self.samples.grid_field(rows) > 0)
        labels, _ = ndimage.label(open_, np.ones((3, 3, 3)))
        away = np.linalg.norm(self.samples.grid_points[open_.ravel()] - place, axis=1)
        if not len(away) or away.min() > 3 * grid.spacing:
            return None
        return np.asarray((labels == labels[open_][away.argmin()]).ravel())


def _next(off: Deviations, given_up: list[NDArray[np.float32]]) -> int | None:
    """The part that is furthest off, but for places that were given up; None where all are near."""
    by_part = off.by_part
    for part in np.argsort(-by_part, kind="stable"):
        if by_part[part] < _ENOUGH:
            return None
        place = off.points[off.worst(part)]
        if all(np.linalg.norm(place - other) > _SAME_PLACE for other in given_up):
            return int(part)
    return None


def _emphasis(off: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.minimum((off / _TWICE) ** 2, _HEAVIEST)


def _halves(samples: FitSamples, voxels: Mask) -> tuple[Mask, Mask]:
    """Both halves of a region along its longest axis."""
    local = samples.grid_points[voxels].astype(np.float64)
    local -= local.mean(axis=0)
    _, axes = np.linalg.eigh(np.einsum("ni,nj->ij", local, local))
    side = local @ axes[:, 2] > 0
    first, second = voxels.copy(), voxels.copy()
    first[voxels], second[voxels] = side, ~side
    return first, second
