"""Parts that change in the end, where they are furthest off at a close look: one is cut, joined by another,
or fitted anew, and all make room for it.

Mending does so at fewer points, before repeats are known, with the neighbours alone moving. Here what is new
has the copies of the part beside it, at the price of one, and is judged when all have been polished.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import Column
from partwright.shapes import Shape
from partwright.superfrusta.close_look import CloseLook, Seen
from partwright.superfrusta.growing import finalists, grow
from partwright.superfrusta.last_polish import BRIEF, MOST_COPIES, SPENT, Polish, Trial
from partwright.superfrusta.mending import Mending
from partwright.superfrusta.merging import folded, owners
from partwright.superfrusta.objective import occupancy_score
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import LeafSteps, RepeatedPart, expanded

Mask = NDArray[np.bool_]
Leaves = list[RepeatedPart]
_GivenUp = tuple[NDArray[np.float32], float]  # a point, and how far about it

_ENOUGH = 0.031  # unit lengths, 1.7 % of the longest side, 0.96 % outwards: what is nearer is left alone
_LOOKED_AT = 2  # places that are looked at for each that is changed: of some no way is known
_SAME_PLACE = 0.03  # unit lengths: what is as near to a place that is changed is changed with it
_REFITTED = 2  # changes of one place that are polished, of those that promise most
_LOOKS = 6  # at each
_HOPELESS, _STILL = 0.01, 0.003  # of the value: so much worse before it is polished, and after half of that
_PRICE = 2.5  # times the settings', as lengths count as much more: what is new has to be worth that
_GAIN = 2e-4  # of the value, for a change to be kept
_WAYS = 3  # to repeat what is new, at most
_TOGETHER, _AS_FAR = 4, 0.8  # places at once, at most, that are off by this share of the furthest
_REMOVALS = 3  # at most
_REMOVED = 3  # parts that are tried for each
_OVERLAP = 0.03  # of what parts cover: so much more may be covered twice in the end
_MOST_LOST = 0.02  # of R, without a part, before the others are polished


@dataclass(frozen=True)
class _State:
    """Leaves (L,), which of them move, the last look at them, and their value, parts paid for."""

    leaves: Leaves
    moving: Mask
    trial: Trial
    value: float

    @cached_property
    def rows(self) -> Rows:
        return expanded(self.leaves)

    @cached_property
    def leaf(self) -> NDArray[np.int64]:
        """(C,) that each copy is of."""
        return np.repeat(np.arange(len(self.leaves)), [1 + len(one.isometries) for one in self.leaves])

    def with_new(self, new: RepeatedPart) -> tuple[Leaves, Mask]:
        """One more, after all that move."""
        last = len(self.leaves) - int(np.argmax(np.append(self.moving[::-1], True)))
        return [*self.leaves[:last], new, *self.leaves[last:]], np.insert(self.moving, last, True)


@dataclass(frozen=True)
class _Bounds:
    """R at least, and the share of what parts cover that more than one does at most."""

    least: float
    most: float


def last_changes(
    shape: Shape, samples: FitSamples, leaves: Leaves, settings: Settings, moving: Mask
) -> Iterator[Leaves]:
    """Leaves (L,) after each change that gains, at most `settings.changes`, and after each removal.

    Those not `moving` (L,) stay, in front and at the end. Nothing changes where an IoU is asked for: it has
    been reached with as few parts as can be.
    """
    copies = sum(1 + len(leaf.isometries) for leaf in leaves)
    if settings.changes and settings.min_iou is None and moving.any() and copies <= MOST_COPIES:
        yield from _LastChanges(CloseLook.at(shape, samples), settings).run(leaves, moving)


@dataclass(frozen=True)
class _LastChanges:
    look: CloseLook
    settings: Settings
    _refitted: set[bytes] = field(default_factory=set)

    @property
    def samples(self) -> FitSamples:
        return self.look.samples

    @property
    def price(self) -> float:
        return _PRICE * self.settings.alpha

    @cached_property
    def mending(self) -> Mending:
        return Mending(self.samples, self.settings)

    def run(self, leaves: Leaves, moving: Mask) -> Iterator[Leaves]:
        best = self.looked_at(leaves, moving)
        bounds = _Bounds(best.trial.score - SPENT, self.overlap(best) + _OVERLAP)
        given_up: list[_GivenUp] = []
        tried = 0
        for _ in range(_LOOKED_AT * self.settings.changes):
            worst = self.worst(best, given_up)
            if worst is None or tried == self.settings.changes:
                break
            ways = list(self.ways(best, worst))
            tried += bool(ways)
            found = self.gaining(best, ways, bounds)
            if found is None:
                off = best.trial.off
                given_up.append((off.points[worst], float(off.off[worst])))
            else:
                best = found
                yield best.leaves
        for _ in range(_REMOVALS):
            found = self.with_one_less(best, bounds)
            if found is None:
                break
            best = found
            yield best.leaves

    def looked_at(self, leaves: Leaves, moving: Mask) -> _State:
        trial = self.polish(leaves, moving).trial(np.stack([leaf.row for leaf in leaves]))
        return _State(leaves, moving, trial, trial.value - self.price * len(leaves))

    def polish(self, leaves: Leaves, moving: Mask) -> Polish:
        settings = replace(self.settings, looks=_LOOKS)
        return Polish(self.look, settings, LeafSteps.of(leaves, settings, moving), BRIEF)

    def overlap(self, state: _State) -> float:
        return self.polish(state.leaves, state.moving).overlap(state.trial.rows)

    def polished(self, state: _State, hopeless: float) -> _State:
        """After steps that gain; given up where its value stays below that of no hope."""
        paid = self.price * len(state.leaves)
        trial = self.polish(state.leaves, state.moving).further(state.trial, hopeless + paid)
        leaves = [
            RepeatedPart(row, leaf.isometries) for row, leaf in zip(trial.rows, state.leaves, strict=True)
        ]
        return _State(leaves, state.moving, trial, trial.value - self.price * len(leaves))

    def worst(self, best: _State, given_up: list[_GivenUp]) -> int | None:
        """The point that is furthest off of parts that move, but for places that were given up."""
        off = best.trial.off
        left = best.moving[best.leaf[off.part]] & (off.off >= _ENOUGH)
        for place, reach in given_up:
            left &= np.linalg.norm(off.points - place, axis=1) > reach
        return int(np.where(left, off.off, 0).argmax()) if left.any() else None

    def gaining(self, best: _State, ways: list[_State], bounds: _Bounds) -> _State | None:
        """The first of these that gains when it is polished, within bounds, of those that promise most;
        None where none does."""
        ways = [way for way in ways if way.value > best.value - _HOPELESS]
        for way in sorted(ways, key=lambda way: -way.value)[:_REFITTED]:
            polished = self.polished(way, best.value - _STILL)
            gains = polished.value > best.value + _GAIN and polished.trial.score >= bounds.least
            if gains and self.overlap(polished) <= bounds.most:
                return polished
        return None

    def ways(self, best: _State, worst: int) -> Iterator[_State]:
        """What is about a point cut or filled, there alone and at others that are as far off, and the part
        there fitted anew; not polished yet."""
        one = self.with_new(best, worst)
        if one is not None:
            yield one
            together = self.with_others(one, best, worst)
            if together is not one:
                yield together
        leaf = int(best.leaf[best.trial.off.part[worst]])
        anew = [self.looked_at(leaves, best.moving) for leaves in self.anew(best, leaf)]
        if anew:
            yield max(anew, key=lambda one: one.value)

    def with_new(self, best: _State, worst: int) -> _State | None:
        """With one part more that cuts or fills what is about a point; None where there is none, or no room
        for it."""
        off = best.trial.off
        leaf = int(best.leaf[off.part[worst]])
        if not self.has_room(best, leaf):
            return None
        found = self.cuts(best, worst) if off.distance[worst] > 0 else self.fills(best, worst)
        return self.repeated(best, self.promising(best, found), leaf) if len(found) else None

    def promising(self, best: _State, found: Rows) -> NDArray[np.float32]:
        """Of new parts (K, 17), the one (17,) that is best by itself: what overlaps best may stick out."""
        if len(found) == 1:
            return found[0]
        alone = [self.looked_at(*best.with_new(RepeatedPart(row))).value for row in found]
        return found[int(np.argmax(alone))]

    def with_others(self, one: _State, best: _State, worst: int) -> _State:
        """The same at other places, cut or filled likewise, that are nearly as far off: while one of them is
        left, the others are no gain."""
        off = best.trial.off
        for _ in range(_TOGETHER - 1):
            there = one.trial.off
            further = self.worst(one, [(off.points[worst], _SAME_PLACE)])
            if further is None or there.off[further] < _AS_FAR * off.off[worst]:
                break
            alike = _is_outside(there, further) == _is_outside(off, worst)
            found = self.with_new(one, further) if alike else None
            if found is None:
                break
            one = found
        return one

    def cuts(self, best: _State, worst: int) -> Rows:
        """(K, 17) to subtract about a point."""
        if not self.settings.carving:
            return best.rows[:0]
        return self.mending.holes(best.rows, best.trial.off, worst)[:1]

    def fills(self, best: _State, worst: int) -> Rows:
        """(K, 17) to add about a point: for all that is missed there, and, as that may go all around the
        assembly, for this place alone."""
        off = best.trial.off
        like = best.rows[off.part[worst]]
        missed = self.mending.missed(best.rows, off, worst)[:1]
        of_all = [self.mending.fitted(voxels, best.rows, like) for voxels in missed]
        here = self.samples.about(*off.about(worst))
        grown = grow(here, best.rows, replace(self.settings, subtract=False), 1)
        return np.concatenate([*of_all, grown.first, grown.last])

    def has_room(self, best: _State, leaf: int) -> bool:
        """Whether a part budget allows one more, with its copies."""
        most = self.settings.max_parts
        return most is None or len(best.rows) + 1 + len(best.leaves[leaf].isometries) <= most

    def repeated(self, best: _State, new: NDArray[np.float32], leaf: int) -> _State:
        """With a new part, alone or with copies as this leaf or another has them, whichever is best."""
        ways = [(), best.leaves[leaf].isometries]
        if self.settings.max_parts is None:
            ways += [one.isometries for one in best.leaves]
        different = {tuple((by.linear.tobytes(), by.shift.tobytes()) for by in way): way for way in ways}
        ways = list(different.values())[:_WAYS]
        states = [self.looked_at(*best.with_new(RepeatedPart(new, way))) for way in ways]
        return max(states, key=lambda one: one.value)

    def anew(self, best: _State, leaf: int) -> Iterator[Leaves]:
        """With a leaf fitted anew, once, to what its first copy stands for."""
        key = best.leaves[leaf].row.tobytes()
        if key in self._refitted:
            return
        self._refitted.add(key)
        rows, copy = best.rows, int(np.flatnonzero(best.leaf == leaf)[0])
        voxels = owners(self.samples, rows) == copy
        if not voxels.any():
            return
        cut = bool((rows[copy:, Column.SIGN] < rows[copy, Column.SIGN]).any())
        region = self.mending.region(voxels, np.delete(rows, copy, axis=0), rows[copy], cut)
        found, _, _ = finalists(self.samples, [region], self.settings, self.settings.overlap)
        for row in found:
            yield [
                RepeatedPart(row if i == leaf else one.row, one.isometries)
                for i, one in enumerate(best.leaves)
            ]

    def with_one_less(self, best: _State, bounds: _Bounds) -> _State | None:
        """Without the leaf that is missed least, where that gains after all others are polished."""
        lost = self.lost(best)
        ways = []
        for leaf in np.argsort(lost, kind="stable")[:_REMOVED]:
            if best.moving[leaf] and lost[leaf] < _MOST_LOST:
                leaves = [one for i, one in enumerate(best.leaves) if i != leaf]
                ways.append(self.looked_at(leaves, np.delete(best.moving, leaf)))
        return self.gaining(best, ways, replace(bounds, least=bounds.least - self.price))

    def lost(self, best: _State) -> NDArray[np.float64]:
        """R (L,) that is lost without each leaf, blends left out; all of it where nothing is left."""
        occupied = self.samples.covered_by(best.rows, self.samples.points)
        added = best.rows[:, Column.SIGN] > 0
        left = [best.leaf != leaf for leaf in range(len(best.leaves))]
        trials = np.stack([folded(occupied[one], added[one]) for one in left])
        lost = occupancy_score(self.samples, folded(occupied, added)) - occupancy_score(self.samples, trials)
        return np.where([added[one].any() for one in left], lost, np.inf)


def _is_outside(off: Seen, point: int) -> bool:
    return bool(off.distance[point] > 0)
