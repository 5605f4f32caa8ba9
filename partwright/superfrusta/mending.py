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
class Trial:
    """An assembly (M, 17), where it is off, and its value: eq. 2 with a price on how far off parts are."""

    rows: Rows
    off: Deviations
    value: float


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
        best = self.trial(rows)
        given_up: list[NDArray[np.float32]] = []
        part: int | None = None
        for _ in range(self.settings.mends + 1):
            trials = self.moved(best, _all(best.rows), best) if part is None else self.ways(best, part)
            allowed = (trial for trial in trials if self.allowed(trial.rows, rows))
            found = max(allowed, key=lambda trial: trial.value, default=best)
            if found.value > best.value:
                best = found
                if self.told is not None:
                    self.told(best.rows)
            elif part is not None:
                given_up.append(best.off.points[best.off.worst(part)])
            part = _next(best.off, given_up)
            if part is None:
                break
        slim = self.slimmed(best)
        polished = self.trial(refine(self.samples, slim.rows, POLISH, self.settings, self.free(slim.rows)))
        better = polished.value > slim.value and self.allowed(polished.rows, slim.rows)
        return polished.rows if better else slim.rows

    def trial(self, rows: Rows) -> Trial:
        off = deviations(self.samples, rows)
        price = self.settings.alpha * len(rows) + self.settings.firmness * off.norm
        return Trial(rows, off, score(self.samples, rows) - price)

    def free(self, rows: Rows) -> Mask:
        return np.arange(len(rows)) >= self.locked

    def allowed(self, trial: Rows, given: Rows) -> bool:
        """Whether a part budget or a target, which thinning has met, still holds."""
        settings = self.settings
        if settings.max_parts is not None and len(trial) > max(settings.max_parts, len(given)):
            return False
        if settings.min_iou is None:
            return True
        least = min(settings.min_iou, volume_iou(self.samples, given))
        return len(trial) <= len(given) and volume_iou(self.samples, trial) >= least

    def slimmed(self, best: Trial) -> Trial:
        """Without the parts that do not pay for themselves any more."""
        while len(best.rows) > max(1, self.locked):
            thinned, value, _ = cheapest_removal(
                self.samples, best.rows, self.settings, self.locked, lambda _, rows: self.trial(rows).value
            )
            if value < best.value or not self.allowed(thinned, best.rows):
                break
            best = self.trial(thinned)
        return best

    def ways(self, best: Trial, part: int) -> Iterator[Trial]:
        """Assemblies that may be better: part and neighbours moved, the most promising changes refitted."""
        moving = neighbours(self.samples, best.rows, part)
        moving[part] = True
        yield from self.moved(best, moving, best)
        if part < self.locked:
            return
        changes = [(self.trial(rows), new) for rows, new in self.changes(best, part)]
        for changed, new in sorted(changes, key=lambda one: -one[0].value)[:_REFITTED]:
            yield changed
            yield from self.moved(changed, np.append(np.delete(moving, part), np.ones(new, bool)), best)

    def moved(self, given: Trial, moving: Mask, best: Trial) -> Iterator[Trial]:
        """The parts moved to where they explain the most, and on to where they are nowhere far off."""
        moving = moving & self.free(given.rows)
        plain = self.trial(refine(self.samples, given.rows, TOUCH_UP, self.settings, moving))
        yield plain
        if plain.value > best.value - _HOPELESS:
            target = self.target(plain, moving)
            yield self.trial(refine(self.samples, plain.rows, _STAGES, self.settings, moving, target))

    def target(self, given: Trial, moving: Mask) -> Target:
        """Samples that weigh by how far off they are, and the points where moving parts are off."""
        samples, apart = self.samples, given.off
        index = samples.optimised_indices
        distance, field = samples.distance[index], samples.distance_of(given.rows, samples.points[index])
        off = np.where(
            (field < 0) & (distance > 0), distance, np.where(distance < 0, np.maximum(field, 0), 0)
        )
        mine = moving[apart.part]
        weight = np.concatenate([samples.weight[index] * (1 + _emphasis(off)), _emphasis(apart.off[mine])])
        return Target(
            np.concatenate([samples.points[index], apart.points[mine]]),
            np.concatenate([distance, apart.distance[mine]]),
            (weight / weight.sum()).astype(np.float32),
        )

    def changes(self, best: Trial, part: int) -> Iterator[tuple[Rows, int]]:
        """Assemblies before any refit, and how many of their last parts are new."""
        samples, rows, off = self.samples, best.rows, best.off
        worst = off.worst(part)
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


def _all(rows: Rows) -> Mask:
    return np.ones(len(rows), bool)


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
