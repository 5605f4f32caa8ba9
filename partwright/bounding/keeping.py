"""`bound`: an assembly made to keep its bounds, as tightly as it can, and checked on fresh samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from partwright.assembly import Assembly, Similarity
from partwright.atomic_io import finishing
from partwright.bounding.check import Checked, check
from partwright.bounding.closing import close
from partwright.bounding.limits import Bounds
from partwright.bounding.pressing import Constraints, on_assembly, on_shape, press
from partwright.errors import NoSurfaceError
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import occupancy_iou
from partwright.shapes import Shape

_DENSE, _ROUGH = 40_000, 12_000
_CELLS = 96
_CLOSINGS, _REPAIRS = 3, 5
# A field may lie nearer to 0 than its surface to the point (as in a fillet): a tolerance that is only just
# missed by the surface is tried again with less of it for the field.
_SHARES, _HOPELESS = (0.9, 0.6), 1.5
_PATIENCE, _PROGRESS = 4, 0.9  # rounds in which the violation has to fall to this share
_SAMPLES = 20_000
_FINEST = 5e-5  # unit lengths

# seeds of the samples that are closed on, and of those that judge
_SEEN, _JUDGED = 100, 200


@dataclass(frozen=True)
class Bounded:
    """assembly: in the shape's own units and place. checked: on fresh samples. complete: not interrupted."""

    assembly: Assembly
    checked: Checked
    complete: bool = True

    @property
    def kept(self) -> bool:
        return self.checked.kept


def bound(
    assembly: Assembly, shape: Shape, bounds: Bounds, held: Sequence[str] = (), seed: int = 0
) -> Bounded:
    """Makes an assembly keep bounds on a shape; one that keeps them already comes back as it is.

    Rounds of `press` lead to it, and each round's result is closed on dense samples; of those that keep the
    bounds there the tightest goes on (else the one that misses them least), and is closed on fresh samples
    until yet others find nothing amiss. Parts named in `held` stay. Ctrl-C ends it with the best so far.

    Raises:
        ParameterError: a part is no SuperFrustum and no solid that is one.
    """
    start = in_unit_frame(assembly, shape.frame)
    checked = check(start, shape, bounds, seed + _JUDGED)
    if checked.kept:
        return Bounded(assembly, checked)
    staying, best = frozenset(held), start
    try:
        for share in _SHARES:
            best, complete = _pressed(best, shape, bounds.narrowed(0.0, share), staying, seed)
            if not complete:
                raise KeyboardInterrupt
            best, checked = _repaired(best, shape, bounds, staying, seed)
            if checked.kept or bounds.tolerance is None or checked.worst_ratio > _HOPELESS:
                break
    except KeyboardInterrupt:
        with finishing():
            checked = check(best, shape, bounds, seed + _JUDGED)
        return Bounded(_back(assembly, best, shape), checked, complete=False)
    return Bounded(_back(assembly, best, shape), checked)


def _pressed(
    start: Assembly, shape: Shape, bounds: Bounds, held: frozenset[str], seed: int
) -> tuple[Assembly, bool]:
    """The best of all rounds, closed; and whether they were left to come to an end."""
    best, least, excesses = start, (np.inf, np.inf), list[float]()
    try:
        for local in _candidates(start, shape, bounds, held, seed):
            tried, worth = _closed(local, shape, bounds, held, seed)
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
    start: Assembly, shape: Shape, bounds: Bounds, held: frozenset[str], seed: int
) -> Iterator[Assembly]:
    yield start
    yield from press(start, shape, bounds, held, seed)


def _closed(
    local: Assembly, shape: Shape, bounds: Bounds, held: frozenset[str], seed: int
) -> tuple[Assembly, tuple[float, float]]:
    """The assembly closed, with what it misses after that, and 1 - IoU at samples of the shape."""
    one_sided = bounds.tolerance is None and (bounds.contain is None) != (bounds.inside is None)
    turns = _CLOSINGS if one_sided else 0  # else one bound would be closed at the cost of the other
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
        local = close(local, wanted, held)
    samples = shape.samples(_SAMPLES, _SAMPLES, seed + _SEEN)
    occupied, inside = _field(best, samples.points) < 0, samples.distance < 0
    return best, (round(excess, 5), 1 - occupancy_iou(occupied, inside))


def _repaired(
    local: Assembly, shape: Shape, bounds: Bounds, held: frozenset[str], seed: int
) -> tuple[Assembly, Checked]:
    """Closed on fresh samples until others find nothing, or it does not get better."""
    checked = check(local, shape, bounds, seed + _JUDGED)
    for turn in range(1, _REPAIRS + 1):
        if checked.kept:
            break
        try:
            # a little more each time: what lies between these samples is the next check's to find
            tight = bounds.narrowed(_FINEST * 2**turn)
            new = close(local, _wanted(local, shape, tight, seed + _SEEN + turn), held)
            judged = check(new, shape, bounds, seed + _JUDGED + turn)
        except NoSurfaceError:
            break
        if sum(judged.excess.values()) >= sum(checked.excess.values()):
            break
        local, checked = new, judged
    return local, checked


def _wanted(local: Assembly, shape: Shape, bounds: Bounds, seed: int, count: int = _DENSE) -> Constraints:
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
