"""`satisfy`: an assembly made to keep its bounds, as tightly as it can, and checked on fresh samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from partwright.assembly import Assembly, Similarity
from partwright.errors import NoSurfaceError
from partwright.methods import Cancellation
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import occupancy_iou
from partwright.shapes import Shape
from partwright.tolerances.augmented_lagrangian import (
    Constraints,
    augmented_lagrangian,
    on_assembly,
    on_shape,
)
from partwright.tolerances.check import Checked, check
from partwright.tolerances.distance_bounds import DistanceBounds
from partwright.tolerances.feasible_offset import offset_to_feasible

_DENSE, _ROUGH = 40_000, 12_000
_CELLS = 96
_OFFSETS, _REPAIRS = 3, 5
# A field may lie nearer to 0 than its surface to the point (as in a fillet): a tolerance that is only just
# missed by the surface is tried again with less of it for the field.
_SHARES, _HOPELESS = (0.9, 0.6), 1.5
_PATIENCE, _PROGRESS = 4, 0.9  # rounds in which the violation has to fall to this share
_SAMPLES = 20_000
_WORSE = 2e-3  # of the IoU: what samples tell no difference by
_FINEST = 5e-5  # unit lengths

# seeds of the samples that offsets are found on, and of those that judge
_SEEN, _JUDGED = 100, 200


@dataclass(frozen=True)
class Bounded:
    """An assembly that was moved to keep bounds, and how far it does."""

    assembly: Assembly
    """In the shape's own units and place."""
    checked: Checked
    """On fresh samples."""
    iou: float
    """At samples of the shape."""
    complete: bool = True
    """Whether it came to its end, and was not interrupted."""

    @property
    def satisfied(self) -> bool:
        return self.checked.satisfied

    def improves_on(self, other: Bounded) -> bool:
        """Whether it keeps the bounds and the other does not, or, where neither does, misses them by less and
        fills the shape as well."""
        if self.satisfied or other.satisfied:
            return self.satisfied and not other.satisfied
        return self.checked.total_excess < other.checked.total_excess and self.iou >= other.iou - _WORSE


def satisfy(
    assembly: Assembly,
    shape: Shape,
    bounds: DistanceBounds,
    locked: Sequence[str] = (),
    seed: int = 0,
    cancel: Cancellation | None = None,
) -> Bounded:
    """Makes an assembly keep bounds on a shape; one that keeps them already comes back as it is.

    Rounds of `augmented_lagrangian` lead to it, and each round's result is offset on dense samples; of those
    that keep the bounds there the tightest goes on (else the one that misses them least), and is offset on
    fresh samples until yet others find nothing amiss. Where a tolerance stays out of reach, the result is the
    nearest to it of those that fill the shape as well as what was given: a few points that are too far off
    are not worth the rest of the surface. Parts named in `locked` stay. `cancel` ends it with the best so
    far.

    Raises:
        ParameterError: a part is no SuperFrustum and no solid that is one.
    """
    start = measured(assembly, shape, bounds, seed)
    if start.satisfied:
        return start
    given, staying = in_unit_frame(assembly, shape.frame), frozenset(locked)
    cancel = cancel or Cancellation()
    search, checked = _Search(given, given, start.iou - _WORSE), start.checked
    for share in _SHARES:
        search.run(shape, bounds.narrowed(0.0, share), staying, seed, cancel)
        search.nearest, checked = _offset_on_fresh_samples(
            search.nearest, shape, bounds, staying, seed, cancel
        )
        hopeless = bounds.tolerance is None or checked.worst_ratio > _HOPELESS
        if checked.satisfied or hopeless or cancel.requested:
            break
    complete = not cancel.requested
    best = _back(assembly, search.nearest, shape)
    nearest = measured(best, shape, bounds, seed, checked, complete)
    if nearest.satisfied or not bounds.only_tolerance:
        return nearest
    sound = measured(_back(assembly, search.sound, shape), shape, bounds, seed, complete=complete)
    found = (replace(start, complete=complete), sound, nearest)
    return reduce(lambda one, other: other if other.improves_on(one) else one, found)


def measured(
    assembly: Assembly,
    shape: Shape,
    bounds: DistanceBounds,
    seed: int = 0,
    checked: Checked | None = None,
    complete: bool = True,
) -> Bounded:
    """An assembly as it is, against bounds; checked: if that is known already."""
    local = in_unit_frame(assembly, shape.frame)
    checked = checked or check(local, shape, bounds, seed + _JUDGED)
    return Bounded(assembly, checked, _iou(local, shape, seed), complete)


@dataclass
class _Search:
    """The best of the rounds so far."""

    nearest: Assembly
    """Misses the bounds least, and where some keep them is the tightest of those."""
    sound: Assembly
    """Misses the bounds least of those whose IoU is at least `least_iou`."""
    least_iou: float

    def run(
        self,
        shape: Shape,
        bounds: DistanceBounds,
        locked: frozenset[str],
        seed: int,
        cancel: Cancellation,
    ) -> None:
        least, least_sound, excesses = (np.inf, np.inf), (np.inf, np.inf), list[float]()
        for local in _candidates(self.nearest, shape, bounds, locked, seed):
            tried, excess = _offset(local, shape, bounds, locked, seed)
            iou = _iou(tried, shape, seed)
            worth = (round(excess, 5), 1 - iou)
            if worth < least:
                self.nearest, least = tried, worth
            if worth < least_sound and iou >= self.least_iou:
                self.sound, least_sound = tried, worth
            if cancel.requested:
                break
            excesses.append(worth[0])
            if least[0] == 0 and bounds.only_tolerance:
                break  # it asks for no more
            if min(excesses[-_PATIENCE:]) > _PROGRESS * min(excesses[:-_PATIENCE], default=np.inf):
                break


def _candidates(
    start: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> Iterator[Assembly]:
    yield start
    yield from augmented_lagrangian(start, shape, bounds, locked, seed)


def _offset(
    local: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> tuple[Assembly, float]:
    """The assembly offset, and what it misses after that."""
    one_sided = bounds.tolerance is None and (bounds.contain is None) != (bounds.inside is None)
    turns = _OFFSETS if one_sided else 0  # else one bound would be met at the cost of the other
    best, excess = local, np.inf
    for turn in range(turns + 1):
        try:
            wanted = _wanted(local, shape, bounds, seed + _SEEN, _ROUGH)
        except NoSurfaceError:
            break
        missed = float(np.abs(wanted.violation(_field(local, wanted.points))).max())
        if missed >= excess:
            break
        best, excess = local, missed
        if missed == 0 or turn == turns:
            break
        local = offset_to_feasible(local, wanted, locked)
    return best, excess


def _iou(local: Assembly, shape: Shape, seed: int) -> float:
    """At samples of the shape."""
    samples = shape.samples(_SAMPLES, _SAMPLES, seed + _SEEN)
    return occupancy_iou(_field(local, samples.points) < 0, samples.distance < 0)


def _offset_on_fresh_samples(
    local: Assembly,
    shape: Shape,
    bounds: DistanceBounds,
    locked: frozenset[str],
    seed: int,
    cancel: Cancellation,
) -> tuple[Assembly, Checked]:
    """Offset on fresh samples until others find nothing, or it does not get better."""
    checked = check(local, shape, bounds, seed + _JUDGED)
    for turn in range(1, _REPAIRS + 1):
        if checked.satisfied or cancel.requested:
            break
        try:
            # a little more each time: what lies between these samples is the next check's to find
            tight = bounds.narrowed(_FINEST * 2**turn)
            new = offset_to_feasible(local, _wanted(local, shape, tight, seed + _SEEN + turn), locked)
            judged = check(new, shape, bounds, seed + _JUDGED + turn)
        except NoSurfaceError:
            break
        if judged.total_excess >= checked.total_excess:
            break
        local, checked = new, judged
    return local, checked


def _wanted(
    local: Assembly, shape: Shape, bounds: DistanceBounds, seed: int, count: int = _DENSE
) -> Constraints:
    """All constraints, on dense samples of the surfaces that they speak of."""
    wanted = on_shape(shape, bounds, _DENSE, seed)
    if bounds.inside is None and bounds.tolerance is None:
        return wanted
    return wanted + on_assembly(local, shape, bounds, count, seed, _CELLS)


def _field(local: Assembly, points: np.ndarray) -> np.ndarray:
    return np.asarray(local.distance(points), dtype=np.float64)


def _back(whole: Assembly, local: Assembly, shape: Shape) -> Assembly:
    """The unit-frame assembly's leaves in the place of the original's; leaves that did not change stay as
    they were, number by number, and those that are gone go."""
    there = Similarity(shape.frame.scale).inverse()
    new = {part.name: part for part in local.parts}
    for old in in_unit_frame(whole, shape.frame).parts:
        if old.name not in new:
            whole = whole.without(old.name)
        elif new[old.name] != old:
            own = new[old.name].transformed(there).translated(shape.frame.centre)
            whole = whole.replace_part(old.name, own)
    return whole
