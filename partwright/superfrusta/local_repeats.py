"""Parts of one form in several places, as wheels and tines, that no symmetry of the whole shape relates.

What parts stand for in the shape must be there again where their copies are to be: parts that are alike by
chance, as an ear and a foot, stay parts of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.fields.columns import ROTATION, Column
from partwright.rows import lengths
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.repeat_candidates import Occupancies, Repeat, without_twins
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.symmetric_fit import images
from partwright.superfrusta.symmetry import Isometry, image_error, refined, shifted

Floats = NDArray[np.float64]

_ALIKE = 1.3  # times that extents may differ before any refit
_SAME = 0.55  # IoU of a part with the image of another from which both may be of one form
_NEAR = 0.02  # unit lengths: the shape's surface that is as near to a part's is what the part stands for
_FEWEST = 24  # points of the shape that say what a part stands for
_LAID = 4  # ways to lay one part onto another that are refined
LOCAL_TOLERANCE = 5e-3  # unit lengths: more than of a whole, as what is beside a part differs
_FINE = 1e-4  # unit lengths: such a distance that cannot be told from none
_ONE_PLACE = 0.03  # unit lengths between middles
_MOST = 24  # copies

_TURNS = Rotation.create_group("O").as_matrix().round()  # of a cube: a frame may be turned, its form not


def local_repeats(
    seen: Occupancies,
    locked: int,
    tolerance: float = LOCAL_TOLERANCE,
    nearly: Sequence[Isometry] = (),
) -> list[Repeat]:
    """Of each part alone, and with others for what is made otherwise where their images are: of seven tines
    some may be one part and some two. The first `locked` rows are in no repeat.

    tolerance: mean distance from the shape's surface to what a part stands for, moved; unit lengths. nearly:
    isometries that may hold for a part after a small motion: one arm is raised a little higher.
    """
    forms = _Forms(seen.samples, seen.rows, locked, tolerance)
    found = (
        one
        for base in range(locked, len(seen.rows))
        for group in (forms.group(base), *forms.nearly(base, nearly))
        if group
        for one in seen.candidates(group, [base], locked)
    )
    return without_twins(one for one in found if forms.hold(one))


@dataclass(frozen=True)
class _Forms:
    """Parts (M, 17) and the shape's surface that each stands for."""

    samples: FitSamples
    rows: Rows
    locked: int
    tolerance: float

    def group(self, base: int) -> tuple[Isometry, ...]:
        """Rigid moves under which what a part stands for is there again: onto parts of the same form, and on
        in the same steps for as long as it is."""
        ways = list(self.onto_others(base))
        kept: list[Isometry] = []
        taken, there = [self.middles[base], *self.middles[: self.locked]], list[Floats]()
        for one in chain(ways, self.all_powers(base, ways, there)):
            place = self.place(base, one)
            if _apart(place, [*taken, *there]) > _ONE_PLACE:
                kept.append(one)
                there.append(place)
            if len(kept) == _MOST:
                break
        return tuple(kept)

    def nearly(self, base: int, isometries: Sequence[Isometry]) -> Iterator[tuple[Isometry]]:
        """Each that takes what a part stands for to where it is again, after a small motion."""
        for one in isometries if len(self.surfaces[base]) >= _FEWEST else ():
            there = self.refined(base, one, self.tolerance / 4)
            if self.there(base, there):
                yield (there,)

    def all_powers(self, base: int, ways: Sequence[Isometry], known: Sequence[Floats]) -> Iterator[Isometry]:
        """Of moves and of their inverses; none of one that is a power of another, as its are, too."""
        found: list[Isometry] = []
        for way in ways:
            if not any(one.near(way) for one in found):
                for one in self.powers(base, way, known):
                    found.append(one)
                    yield one

    def powers(self, base: int, way: Isometry, known: Sequence[Floats]) -> Iterator[Isometry]:
        """Of a move, and of its inverse where it does not come round to the part, for as long as each leads
        where what the part stands for is. Those to a place that is `known`, where powers of a turn lead again
        and again, are not refined where they need not be."""
        for step in (way, way.inverse()):
            power = step
            while _apart(self.place(base, power), [self.middles[base]]) > _ONE_PLACE:
                there = power
                if _apart(self.place(base, power), known) > _ONE_PLACE / 2 or not self.there(base, power):
                    there = self.refined(base, power, self.tolerance / 2)
                if not self.there(base, there):
                    break
                yield there
                power = step @ power
            else:
                return  # it came round to the part, and the other way round it would come to the same places

    def place(self, base: int, isometry: Isometry) -> Floats:
        """Where (3,) a part's middle comes to."""
        return np.asarray(isometry(self.middles[base][None])[0])

    def hold(self, repeat: Repeat) -> bool:
        """Whether what each base stands for is there again under each isometry."""
        return all(self.there(base, one) for base in repeat.bases for one in repeat.isometries)

    def there(self, base: int, isometry: Isometry) -> bool:
        mine = self.surfaces[base]
        return len(mine) >= _FEWEST and image_error(self.samples.grid, isometry, mine) < self.tolerance

    def refined(self, base: int, isometry: Isometry, enough: float = _FINE) -> Isometry:
        return refined(self.samples.grid, isometry, self.surfaces[base], shifted, enough)

    def onto_others(self, base: int) -> Iterator[Isometry]:
        """The best way onto each part of the same form."""
        if len(self.surfaces[base]) < _FEWEST:
            return
        own = self.extents[base]
        with np.errstate(divide="ignore", invalid="ignore"):  # what has no extent at all is like none
            ratio = np.maximum(self.extents / own, own / self.extents).max(axis=1)
        alike = (ratio < _ALIKE) & (self.rows[:, Column.SIGN] == self.rows[base, Column.SIGN])
        alike[: self.locked] = alike[base] = False
        for other in np.flatnonzero(alike).tolist():
            way = self.onto(base, other)
            if way is not None:
                yield way

    def onto(self, base: int, other: int) -> Isometry | None:
        """The way from one part onto another that takes what it stands for nearest to the shape's surface;
        None where none does. Of equals the first, which turns nothing."""
        turns = [np.eye(3), *(self.frames[other] @ turn @ self.frames[base].T for turn in _TURNS)]
        ways = [Isometry(turn, self.middles[other] - turn @ self.middles[base]) for turn in turns]
        samples, there = self.samples, self.rows[[other]]
        points = samples.points[samples.parts_of(there, samples.points)[0] < _NEAR]
        laid = images(self.rows[[base]], ways)[:, 0]
        covered = samples.covered_by(np.concatenate([there, laid]), points)
        both, either = (covered[1:] & covered[0]).sum(axis=1), (covered[1:] | covered[0]).sum(axis=1)
        iou = both / np.maximum(either, 1)
        best, least = None, self.tolerance
        for i in (0, *(1 + np.argsort(-iou[1:], kind="stable")[:_LAID])):
            if iou[i] < _SAME:
                continue
            way = self.refined(base, ways[i])
            error = image_error(samples.grid, way, self.surfaces[base])
            if error < least - _FINE:
                best, least = way, error
        return best

    @cached_property
    def surfaces(self) -> list[Floats]:
        near = np.abs(self.samples.parts_of(self.rows, self.samples.surface)) < _NEAR
        return [self.samples.surface[one].astype(np.float64) for one in near]

    @cached_property
    def own(self) -> Floats:
        """(M, K, 3) points of the parts' own surfaces."""
        return surface_points(self.rows)

    @cached_property
    def middles(self) -> Floats:
        return 0.5 * (self.own.min(axis=1) + self.own.max(axis=1))

    @cached_property
    def frames(self) -> Floats:
        quaternions = self.rows[:, ROTATION].astype(np.float64)
        return np.asarray(Rotation.from_quat(quaternions, scalar_first=True).as_matrix())

    @cached_property
    def extents(self) -> Floats:
        """(M, 3) along the parts' own axes, the shortest first."""
        return np.sort(np.ptp(np.einsum("mji,mkj->mki", self.frames, self.own), axis=1), axis=1)


def _apart(place: Floats, others: Sequence[Floats]) -> float:
    """How far a place (3,) is from the nearest of others."""
    return float(lengths(np.array(others) - place).min()) if others else np.inf
