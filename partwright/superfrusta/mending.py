"""Mending what an eye sees: parts that stick out of the shape, and places that none reaches.

Optimisation and search serve overlaps, which hardly feel either. Here the part that is furthest off is moved,
fitted anew, split, joined by another or taken away, whichever serves an objective best that feels both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from partwright.at_once import at_once, in_turn, thread_count
from partwright.fields.columns import ROTATION, Column
from partwright.fields.kernel import Target
from partwright.superfrusta.deviations import Deviations, deviations
from partwright.superfrusta.growing import Grown, Region, carve, finalists, fit_regions, grow
from partwright.superfrusta.merging import Merger, carried_out, mergers, owners
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.pruning import cheapest_removal, neighbours
from partwright.superfrusta.refining import POLISH, TOUCH_UP, Stages, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

Mask = NDArray[np.bool_]

_ENOUGH = 0.026  # unit lengths, 1.4 % of the longest side: below, hardly any try bears fruit
_FAR = 0.045  # unit lengths off from which on a part makes room for several
_REGROWN = 3  # at most
_TWICE = 0.02  # unit lengths off at which a sample weighs twice
_HEAVIEST = 25.0  # times that a sample may weigh
_SAME_PLACE = 0.02  # unit lengths
_WORTH_A_TRY = 1e-3  # of the objective
_IN_VAIN = 5  # tries in a row, after which none bears fruit: parts that are left are less far off
_AGAIN = 0.01  # of the objective: after so much progress what was given up is tried again
_STAGES: Stages = ((40.0, 4), (100.0, 5))
_HOPELESS = 0.02  # of the objective: what is so much worse after a refit goes no further
_REFITTED = 2  # of the ways to change a part
_HOLES = 2  # that are looked for there
_AS_FAR = 0.6  # of the furthest: what is missing elsewhere beside the same part is tried together with it
_AT_ONCE = 4  # such places at most
_JOINED = 4  # pairs at most, and of the most promising that are tried for each


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
    _of_whole: dict[bytes, Grown] = field(default_factory=dict)

    def __call__(self, rows: Rows) -> Rows:
        """Rows (M, 17) after at most `settings.mends` tries, without parts that no longer pay."""
        best = self.trial(rows)
        given_up: list[tuple[NDArray[np.float32], float]] = []
        part: int | None = None
        vain = 0  # tries in a row
        for _ in range(self.settings.mends + 1):
            trials = [self.firmed(best, _all(best.rows))] if part is None else self.ways(best, part)
            allowed = (trial for trial in trials if self.allowed(trial.rows, rows))
            found = max(allowed, key=lambda trial: trial.value, default=best)
            if part is None or found.value >= best.value + _WORTH_A_TRY:
                vain = 0
            else:
                vain += 1
                given_up.append((best.off.points[best.off.worst(part)], best.value))
            if found.value > best.value:
                best = found
                if self.told is not None:
                    self.told(best.rows)
            part = next_to_mend(best, given_up)
            if part is None or vain == _IN_VAIN:
                break
        slim = self.slimmed(self.joined(best))
        polished = self.trial(refine(self.samples, slim.rows, POLISH, self.settings, self.free(slim.rows)))
        better = polished.value > slim.value and self.allowed(polished.rows, slim.rows)
        return self.renewed(polished if better else slim).rows

    def trial(self, rows: Rows, most: float | None = None) -> Trial:
        """most: what it would be worth if it were nowhere off, if that is known."""
        off = deviations(self.samples, rows)
        most = self.most(rows) if most is None else most
        return Trial(rows, off, most - self.settings.firmness * off.norm)

    def most(self, rows: Rows) -> float:
        """What an assembly would be worth if it were nowhere off, which takes a third of the time."""
        return score(self.samples, rows) - self.settings.alpha * len(rows)

    def promising(self, changes: Iterable[tuple[Rows, Mask]]) -> list[tuple[Trial, Mask]]:
        """The changes that are worth the most; others are not looked at closer than it takes to know that."""
        found: list[tuple[Trial, Mask]] = []
        changes, threads = list(changes), self.samples.threads
        worth = at_once([partial(self.most, rows) for rows, _ in changes], threads)
        pairs = zip(worth, changes, strict=True)
        order = [(most, *change) for most, change in sorted(pairs, key=lambda one: -one[0])]
        trials = in_turn([partial(self.trial, rows, most) for most, rows, _ in order], threads)
        for most, _, moving in order:
            if len(found) == _REFITTED and most <= found[-1][0].value:
                break
            found = sorted([*found, (next(trials), moving)], key=lambda one: -one[0].value)
            del found[_REFITTED:]
        return found

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

    def renewed(self, best: Trial) -> Trial:
        """With parts fitted anew to what each stands for, all in one batch, where that is worth a part.

        A small disc that has become a box is too near everywhere to be mended. What is worth less would only
        make parts differ that are to be alike.
        """
        samples, rows = self.samples, best.rows
        owner = owners(samples, rows)
        parts = [part for part in range(self.locked, len(rows)) if (owner == part).any()]
        regions = [
            self.region(owner == one, np.delete(rows, one, 0), rows[one], _cut(rows, one)) for one in parts
        ]
        if not regions:
            return best
        found = fit_regions(samples, regions, self.settings, self.settings.overlap)
        trials = [_with(rows, part, new) for part, new in zip(parts, found, strict=True)]
        scores = at_once([partial(score, samples, trial) for trial in trials], samples.threads)
        gains = np.array(scores) - score(samples, rows)
        left = [int(i) for i in np.argsort(-gains, kind="stable") if gains[i] >= _WORTH_A_TRY]
        while left:
            ways = [partial(self.trial, _with(best.rows, parts[i], found[i])) for i in left]
            for trial in in_turn(ways, samples.threads):
                left = left[1:]
                if trial.value > best.value + self.settings.alpha and self.allowed(trial.rows, best.rows):
                    best = trial
                    break
        return best

    def joined(self, best: Trial) -> Trial:
        """With pairs of parts as one where that pays: what mending added may make others vain.

        What would replace a pair is fitted once, for pairs whose members are both still there.
        """
        samples, settings = self.samples, self.settings
        left = mergers(samples, best.rows, settings, self.locked) if settings.merging else []
        part_of = np.arange(len(best.rows))  # which of the parts as they were each row is; -1: a joined one
        while left := [one for one in left if one.gain > -_HOPELESS and np.isin(one.pair, part_of).all()]:
            first = left[:_JOINED]
            tried = at_once([partial(self.merged, best, one, part_of) for one in first], self.samples.threads)
            gaining = [(trial, one) for trials, one in zip(tried, first, strict=True) for trial in trials]
            if not gaining:
                break
            best, joined = max(gaining, key=lambda pair: pair[0].value)
            part_of[part_of == joined.pair[0]] = -1
            part_of = part_of[part_of != joined.pair[1]]
            left = [one for _, one in gaining] + left[_JOINED:]
        return best

    def merged(self, best: Trial, merger: Merger, part_of: NDArray[np.int64]) -> list[Trial]:
        """With a pair as one: the new part fitted alone, or with its neighbours where that does not pay.

        These are where they are nowhere far off, which a refit may undo. None where neither pays.
        """
        first, second = (int(np.flatnonzero(part_of == part)[0]) for part in merger.pair)
        place = self.samples, best.rows, first, second, merger.part, self.settings, self.locked
        for alone in (True, False):
            trial = self.trial(carried_out(*place, alone=alone))
            if trial.value > best.value and self.allowed(trial.rows, best.rows):
                return [trial]
        return []

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

    def ways(self, best: Trial, part: int) -> list[Trial]:
        """Assemblies that may be better: part and neighbours moved, the most promising changes refitted."""
        moving = neighbours(self.samples, best.rows, part)
        moving[part] = True
        if part < self.locked:
            return [self.firmed(best, moving)]
        changes = self.promising(self.changes(best, part, moving))
        jobs: list[Callable[[], list[Trial]]] = [lambda: [self.firmed(best, moving)]]
        jobs += [partial(self.refitted, trial, changed, best) for trial, changed in changes]
        # The change that promises most is mostly the best; another only counts where it does not help, and is
        # tried before that is known where a core would be idle.
        threads, needed = self.samples.threads, 2
        known = at_once(jobs[: max(needed, thread_count(threads))], threads)
        tried = known[:needed]
        if all(trial.value <= best.value for trials in tried for trial in trials):
            tried = known[needed:] + at_once(jobs[len(known) :], threads)
        return [trial for trials in tried for trial in trials]

    def refitted(self, changed: Trial, moving: Mask, best: Trial) -> list[Trial]:
        """A change, its parts moved to where they explain the most, and to where they are nowhere far off."""
        free = moving & self.free(changed.rows)
        plain = self.trial(refine(self.samples, changed.rows, TOUCH_UP, self.settings, free))
        firm = [self.firmed(plain, moving)] if plain.value > best.value - _HOPELESS else []
        return [changed, plain, *firm]

    def firmed(self, given: Trial, moving: Mask) -> Trial:
        """The parts moved to where they are nowhere far off."""
        moving = moving & self.free(given.rows)
        target = self.target(given, moving)
        return self.trial(refine(self.samples, given.rows, _STAGES, self.settings, moving, target))

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

    def changes(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        """Assemblies before any refit, and which of their parts move: those marked, and new ones."""
        off, worst = best.off, best.off.worst(part)
        jobs = [self.without, self.with_another]
        if off.off[worst] > _FAR:
            jobs.append(self.regrown)
        if off.distance[worst] <= 0:
            jobs.append(self.filled)
        elif self.settings.carving:
            jobs += [self.cut, self.drilled]
        found = at_once([partial(job, best, part, moving) for job in jobs], self.samples.threads)
        return [one for of_job in found for one in of_job]

    def without(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        others = np.delete(best.rows, part, axis=0)
        return [(others, np.delete(moving, part))] if (others[:, Column.SIGN] > 0).any() else []

    def with_another(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        """In the part's own place, where what is new is cut by what cuts the part."""
        mine = owners(self.samples, best.rows) == part
        if not mine.any():
            return []
        others, still = np.delete(best.rows, part, axis=0), np.delete(moving, part)
        cut = _cut(best.rows, part)
        place = [part if cut else len(others)]
        new = self.fitted(mine, others, best.rows[part], cut)
        return [(np.insert(others, place, new, axis=0), np.insert(still, place, True))]

    def regrown(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        others, still = np.delete(best.rows, part, axis=0), np.delete(moving, part)
        grown = grow(self.samples, others, self.settings, _REGROWN)
        if not len(grown):
            return []
        begun = np.insert(still, [self.locked] * len(grown.first), True)
        return [(grown.joined(others, self.locked), np.append(begun, _all(grown.last)))]

    def cut(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        carved = self.carved(best.rows)
        return [_with_new(best.rows, moving, carved.last)] if len(carved) else []

    def drilled(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        holes = self.holes(best.rows, best.off, best.off.worst(part))
        return [_with_new(best.rows, moving, one[None]) for one in holes]

    def filled(self, best: Trial, part: int, moving: Mask) -> list[tuple[Rows, Mask]]:
        """What is missing about the worst place, alone and with what else is."""
        rows = best.rows
        missed = self.missed(rows, best.off, best.off.worst(part))
        found = at_once(
            [partial(self.fitted, voxels, rows, rows[part]) for voxels in missed], self.samples.threads
        )
        ways = [found[0]] if found else []
        if len(found) > 1:
            ways.append(np.concatenate(found))
        return [_with_new(rows, moving, new) for new in ways]

    def carved(self, rows: Rows) -> Grown:
        """What could be subtracted anywhere: the same for every part that is tried in vain."""
        key = rows.tobytes()
        if key not in self._of_whole:
            self._of_whole.clear()
            self._of_whole[key] = carve(self.samples, rows, self.settings, self.settings.regions)
        return self._of_whole[key]

    def holes(self, rows: Rows, off: Deviations, worst: int) -> Rows:
        """Parts (M, 17) to subtract about a point that is covered, by samples of that place alone: a hole may
        be as narrow as a voxel."""
        return carve(self.samples.about(*off.about(worst), rows), rows, self.settings, _HOLES).last

    def fitted(self, voxels: Mask, others: Rows, like: NDArray[np.float32], under: bool = False) -> Rows:
        """The best part (1, 17) for the voxels, beside the others and before those that are subtracted if it
        goes `under` them; `like` gives a frame to start from."""
        region = self.region(voxels, others, like, under)
        found, _, losses = finalists(self.samples, [region], self.settings, self.settings.overlap)
        return found[[int(losses.argmin())]]

    def region(self, voxels: Mask, others: Rows, like: NDArray[np.float32], under: bool) -> Region:
        """What `fitted` fits a part to."""
        depth = float(np.abs(self.samples.grid.values.ravel()[voxels]).max())
        return Region(voxels, others, depth, 0.2, 0.3, like[None, ROTATION], float(like[Column.SIGN]), under)

    def missed(self, rows: Rows, off: Deviations, worst: int) -> list[Mask]:
        """The connected voxels inside the shape that no part covers, about the worst point, and about others
        of its part that are nearly as far off: while one of two antennas is missing, the other is no gain."""
        grid = self.samples.grid
        open_ = (grid.values < 0) & (self.samples.grid_field(rows) > 0)
        if not open_.any():
            return []
        labels, _ = ndimage.label(open_, np.ones((3, 3, 3)))
        alike = (off.part == off.part[worst]) & (off.distance <= 0) & (off.off > _AS_FAR * off.off[worst])
        points = off.points[alike][np.argsort(-off.off[alike], kind="stable")]
        away, nearest = cKDTree(self.samples.grid_points[open_.ravel()]).query(points)
        if away[0] > 3 * grid.spacing:
            return []
        regions = labels[open_][nearest[away <= 3 * grid.spacing]]
        _, first = np.unique(regions, return_index=True)
        return [(labels == regions[one]).ravel() for one in np.sort(first)[:_AT_ONCE]]


def next_to_mend(best: Trial, given_up: list[tuple[NDArray[np.float32], float]]) -> int | None:
    """The part that is furthest off, but for places that were given up; None where all are near.

    What is worse elsewhere hides what mending a place is worth: given up once, it is tried again later.
    """
    by_part = best.off.by_part
    hopeless = [place for place, value in given_up if best.value < value + _AGAIN]
    for part in np.argsort(-by_part, kind="stable"):
        if by_part[part] < _ENOUGH:
            return None
        place = best.off.points[best.off.worst(part)]
        if all(np.linalg.norm(place - other) > _SAME_PLACE for other in hopeless):
            return int(part)
    return None


def _all(rows: Rows) -> Mask:
    return np.ones(len(rows), bool)


def _with_new(rows: Rows, moving: Mask, new: Rows) -> tuple[Rows, Mask]:
    return np.concatenate([rows, new]), np.append(moving, _all(new))


def _cut(rows: Rows, part: int) -> bool:
    """Whether others are subtracted from a part."""
    return bool((rows[part:, Column.SIGN] < rows[part, Column.SIGN]).any())


def _with(rows: Rows, part: int, new: NDArray[np.float32]) -> Rows:
    """The rows with one more (17,) in a part's place."""
    result = rows.copy()
    result[part] = new
    return result


def _emphasis(off: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.minimum((off / _TWICE) ** 2, _HEAVIEST)
