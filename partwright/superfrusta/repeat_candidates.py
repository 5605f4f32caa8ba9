"""Parts that may stand for others under a symmetry of the shape: one for its images, or groups for groups.

What one side has as one part the other may have as two; of such sides the better one is to stand for all.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import Column
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.symmetric_fit import images
from partwright.superfrusta.symmetry import Isometry, Symmetry

_EVERY = 6  # samples that matching looks at
_SELF = 0.5  # IoU from which a part and its image are the same place
_COVERED = 0.6  # share of a part within the images of another from which they replace it
_ON_ONE_SIDE = 0.85  # share of a part in one domain of the symmetry from which it belongs there
_MEETS = 0.25  # of the smaller: what a part and the image of another share, if both stand for one place

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Repeat:
    """Parts `bases` with their images in place of the parts `replaced`."""

    bases: tuple[int, ...]
    isometries: tuple[Isometry, ...]
    replaced: frozenset[int]

    @property
    def parts(self) -> frozenset[int]:
        return self.replaced | frozenset(self.bases)


def repeat_candidates(seen: Occupancies, found: Sequence[tuple[Isometry, ...]], locked: int) -> list[Repeat]:
    """Of sets of isometries under which the shape stays what it is; none twice.

    Bases that replace nothing may bring what is missing where their images go. The first `locked` rows are in
    no repeat.
    """
    every = range(locked, len(seen.rows))
    return without_twins(one for group in found for one in seen.candidates(group, every, locked))


def whole_sides(seen: Occupancies, planes: Sequence[Symmetry], locked: int) -> list[Repeat]:
    """All that lies on one side of a mirror plane for all that lies on the other, and the other way about.

    However differently both were cut into parts, and whatever they have in common.
    """
    sizes = np.maximum(seen.parts.sum(axis=1), 1)
    found = []
    for plane in planes:
        above = (seen.points - plane.centre) @ plane.axis > 0
        share = (seen.parts & above).sum(axis=1) / sizes
        share[:locked] = 0.5  # which counts as on neither
        sides = [np.flatnonzero(one >= _ON_ONE_SIDE).tolist() for one in (share, 1 - share)]
        if all(sides):
            for bases, replaced in (sides, sides[::-1]):
                found.append(Repeat(tuple(bases), (plane.isometry,), frozenset(replaced)))
    return found


def without_twins(wanted: Iterable[Repeat]) -> list[Repeat]:
    """The first of those that are of the same parts."""
    result: dict[tuple[tuple[int, ...], frozenset[int], int], Repeat] = {}
    for one in wanted:
        result.setdefault((one.bases, one.replaced, len(one.isometries)), one)
    return list(result.values())


@dataclass(frozen=True)
class Occupancies:
    """Where parts of `rows` (M, 17) are: `parts` (M, N) at those of the samples, `points` (N, 3), that any
    covers."""

    samples: FitSamples
    rows: Rows
    points: NDArray[np.float32]
    parts: Mask

    @classmethod
    def of(cls, samples: FitSamples, rows: Rows) -> Occupancies:
        points = samples.points[::_EVERY]
        parts = samples.covered_by(rows, points)
        covered = parts.any(axis=0)
        return cls(samples, rows, points[covered], parts[:, covered])

    def candidates(self, group: Sequence[Isometry], bases: Iterable[int], locked: int) -> Iterator[Repeat]:
        """Repeats under the isometries of a group, of each of the bases by itself and with others."""
        rows = images(self.rows, group)
        there = np.stack([self.samples.covered_by(of_one, self.points) for of_one in rows])
        meeting = _meeting(self.rows, self.parts, there)
        for base in bases:
            for one in (
                _of_part(self.rows, self.parts, there[:, base], group, base, locked),
                _of_group(self.points, self.parts, meeting, group, base, locked),
            ):
                if one is not None:
                    yield one


def _of_part(
    rows: Rows, parts: Mask, images: Mask, group: Sequence[Isometry], base: int, locked: int
) -> Repeat | None:
    """One part for those that its images (K, N) cover. It may lie on a plane or an axis, so that some images
    are the same."""
    elsewhere = distinct(parts[base], images)
    if not elsewhere:
        return None
    covered = images[elsewhere].any(axis=0)
    share = (parts & covered).sum(axis=1) / np.maximum(parts.sum(axis=1), 1)
    share[:locked] = share[base] = 0
    share[rows[:, Column.SIGN] != rows[base, Column.SIGN]] = 0
    replaced = frozenset(np.flatnonzero(share > _COVERED).tolist())
    return Repeat((base,), tuple(group[i] for i in elsewhere), replaced) if replaced else None


def distinct(base: Mask, images: Mask) -> list[int]:
    """Images (K, N) that are neither where the part itself is nor where an earlier one is."""
    kept: list[int] = []
    for i, one in enumerate(images):
        others = np.concatenate([base[None], images[kept]])
        both, either = (others & one).sum(axis=1), (others | one).sum(axis=1)
        if (both < _SELF * either).all():
            kept.append(i)
    return kept


def _of_group(
    points: NDArray[np.float32],
    parts: Mask,
    meeting: Mask,
    group: Sequence[Isometry],
    base: int,
    locked: int,
) -> Repeat | None:
    """A part and others on its side for all that their images meet on the other sides.

    A side is what lies nearer to the part's middle than to the images of this (a Dirichlet domain). What lies
    on several is in no group.
    """
    if not parts[base].any():
        return None
    middle = points[parts[base]].mean(axis=0, dtype=np.float64)[None]
    middles = np.concatenate([middle, *(isometry(middle) for isometry in group)])
    side = ((points[:, None] - middles) ** 2).sum(axis=-1).argmin(axis=1)
    share = np.stack([(parts & (side == k)).sum(axis=1) for k in range(len(middles))], axis=1)
    whole = share.max(axis=1) >= _ON_ONE_SIDE * np.maximum(parts.sum(axis=1), 1)
    whole[:locked] = False
    side_of = np.where(whole, share.argmax(axis=1), -1)
    if side_of[base] != 0:
        return None
    together = {base}
    todo = [base]
    while todo:
        one = todo.pop()
        met = set(np.flatnonzero(meeting[one] & whole & (side_of != side_of[one])).tolist()) - together
        together |= met
        todo += sorted(met)
    bases = tuple(sorted(one for one in together if side_of[one] == 0))
    return Repeat(bases, tuple(group), frozenset(together - set(bases)))


def _meeting(rows: Rows, parts: Mask, images: Mask) -> Mask:
    """(M, M) whether parts and images (K, M, N) of others are in one place, and all added or all cut."""
    sizes = parts.sum(axis=1)
    least = _MEETS * np.maximum(np.minimum(sizes[:, None], sizes), 1)
    whole = parts.astype(np.float32)
    met = np.any([image.astype(np.float32) @ whole.T > least for image in images], axis=0)
    sign = rows[:, Column.SIGN]
    return np.asarray((met | met.T) & (sign[:, None] == sign))
