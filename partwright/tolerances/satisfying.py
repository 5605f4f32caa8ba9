"""`satisfy`: an assembly made to keep its bounds, as tightly as it can, and checked on fresh samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Similarity
from partwright.atomic_io import finishing
from partwright.errors import NoSurfaceError
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
_FINEST = 5e-5  # unit lengths

# seeds of the samples that offsets are found on, and of those that judge
_SEEN, _JUDGED = 100, 200


@dataclass(frozen=True)
class Bounded:
    """assembly: in the shape's own units and place. checked: on fresh samples. complete: not interrupted."""

    assembly: Assembly
    checked: Checked
    complete: bool = True

    @property
    def satisfied(self) -> bool:
        return self.checked.satisfied


def satisfy(
    assembly: Assembly, shape: Shape, bounds: DistanceBounds, locked: Sequence[str] = (), seed: int = 0
) -> Bounded:
    """Makes an assembly keep bounds on a shape; one that keeps them already comes back as it is.

    Rounds of `augmented_lagrangian` lead to it, and each round's result is offset on dense samples; of those
    that keep the bounds there the tightest goes on (else the one that misses them least), and is offset on
    fresh samples until yet others find nothing amiss. Parts named in `locked` stay. Ctrl-C ends it with the
    best so far.

    Raises:
        ParameterError: a part is no SuperFrustum and no solid that is one.
    """
    start = in_unit_frame(assembly, shape.frame)
    checked = check(start, shape, bounds, seed + _JUDGED)
    if checked.satisfied:
        return Bounded(assembly, checked)
    staying, best = frozenset(locked), start
    try:
        for share in _SHARES:
            best, complete = _optimised(best, shape, bounds.narrowed(0.0, share), staying, seed)
            if not complete:
                raise KeyboardInterrupt
            best, checked = _offset_on_fresh_samples(best, shape, bounds, staying, seed)
            if checked.satisfied or bounds.tolerance is None or checked.worst_ratio > _HOPELESS:
                break
    except KeyboardInterrupt:
        with finishing():
            checked = check(best, shape, bounds, seed + _JUDGED)
        return Bounded(_back(assembly, best, shape), checked, complete=False)
    return Bounded(_back(assembly, best, shape), checked)


def _optimised(
    start: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> tuple[Assembly, bool]:
    """The best of all rounds, offset; and whether they were left to come to an end."""
    best, least, excesses = start, (np.inf, np.inf), list[float]()
    try:
        for local in _candidates(start, shape, bounds, locked, seed):
            tried, worth = _offset(local, shape, bounds, locked, seed)
            if worth < least:
                best, least = tried, worth
            excesses.append(worth[0])
            if least[0] == 0 and bounds.contain is None and bounds.inside is None:
                break  # a tolerance asks for no more
            if min(excesses[-_PATIENCE:]) > _PROGRESS * min(excesses[:-_PATIENCE], default=np.inf):
                break
    except KeyboardInterrupt:
        return best, False
    return best, True


def _candidates(
    start: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> Iterator[Assembly]:
    yield start
    yield from augmented_lagrangian(start, shape, bounds, locked, seed)


def _offset(
    local: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> tuple[Assembly, tuple[float, float]]:
    """The assembly offset, with what it misses after that, and 1 - IoU at samples of the shape."""
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
    samples = shape.samples(_SAMPLES, _SAMPLES, seed + _SEEN)
    occupied, inside = _field(best, samples.points) < 0, samples.distance < 0
    return best, (round(excess, 5), 1 - occupancy_iou(occupied, inside))


def _offset_on_fresh_samples(
    local: Assembly, shape: Shape, bounds: DistanceBounds, locked: frozenset[str], seed: int
) -> tuple[Assembly, Checked]:
    """Offset on fresh samples until others find nothing, or it does not get better."""
    checked = check(local, shape, bounds, seed + _JUDGED)
    for turn in range(1, _REPAIRS + 1):
        if checked.satisfied:
            break
        try:
            # a little more each time: what lies between these samples is the next check's to find
            tight = bounds.narrowed(_FINEST * 2**turn)
            new = offset_to_feasible(local, _wanted(local, shape, tight, seed + _SEEN + turn), locked)
            judged = check(new, shape, bounds, seed + _JUDGED + turn)
        except NoSurfaceError:
            break
        if sum(judged.excess.values()) >= sum(checked.excess.values()):
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
