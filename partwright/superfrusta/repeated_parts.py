"""Repeats: parts that a symmetry of the shape takes to one another become one leaf with several instances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import Column
from partwright.superfrusta.deviations import deviations
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded, image, refit
from partwright.superfrusta.symmetry import Isometry, Symmetry, groups

_EVERY = 6  # samples that matching looks at
_SELF = 0.5  # IoU from which a part and its image are the same place
_COVERED = 0.6  # share of a part within the images of another from which they replace it
_TRIED = 24  # repeats that are scored
_UNREFITTED_SCORE_LOSS = 0.01  # of R: a repeat that costs more before a refit is not tried
_GRID_EVERY = 3
_TOLERANCE = np.array([2e-3, 1e-3, 4e-3])  # of R, IoU and deviations, that all repeats together may cost
_REFIT = ((100.0, 6),)


@dataclass(frozen=True)
class Repeat:
    """Part `base` with its images in place of the parts `replaced`."""

    base: int
    isometries: tuple[Isometry, ...]
    replaced: frozenset[int]


def repeat(
    samples: FitSamples, rows: Rows, found: Sequence[Symmetry], settings: Settings, locked: int = 0
) -> list[RepeatedPart]:
    """The assembly as leaves, of which those that repeat under the symmetries are one each.

    Repeats that replace the most parts come first. Together they cost at most 2e-3 of R, 1e-3 of IoU and
    4e-3 unit lengths of the deviations: where they cost more, the copies of each leaf are refitted as one,
    and if that is not enough the costliest repeats are given up. An IoU that the settings ask for is kept.
    The first `locked` rows stay leaves of their own.
    """
    reached = _measures(samples, rows)
    least = reached - _TOLERANCE
    if settings.min_iou is not None:
        least[1] = max(least[1], min(reached[1], settings.min_iou))

    def good(leaves: list[RepeatedPart]) -> bool:
        return bool((_measures(samples, expanded(leaves)) >= least).all())

    wanted = candidates(samples, rows, groups(found), locked)
    chosen = _chosen(samples, rows, wanted)
    leaves = _leaves(rows, chosen)
    if good(leaves):
        return leaves
    leaves = refit(samples, leaves, _REFIT, settings, locked)
    if good(leaves):
        return leaves
    kept: list[Repeat] = []
    for one in chosen:
        if good(_leaves(rows, [*kept, one])):
            kept.append(one)
    return _leaves(rows, kept)


def _measures(samples: FitSamples, rows: Rows) -> NDArray[np.float64]:
    """R, IoU on the grid (a refit leans towards the samples that it saw), and the deviations, negative."""
    occupied = samples.distance_of(rows, samples.grid_points[::_GRID_EVERY]) < 0
    inside = samples.grid.values.ravel()[::_GRID_EVERY] < 0
    both, either = np.count_nonzero(occupied & inside), np.count_nonzero(occupied | inside)
    return np.array([score(samples, rows), both / np.maximum(either, 1), -deviations(samples, rows).norm])


def candidates(
    samples: FitSamples, rows: Rows, found: Sequence[tuple[Isometry, ...]], locked: int
) -> list[Repeat]:
    """Repeats that would replace parts, those that replace the most first."""
    points = samples.points[::_EVERY]
    parts = samples.parts_of(rows, points) < 0
    sizes = np.maximum(parts.sum(axis=1), 1)
    result = []
    for group in found:
        for base in range(locked, len(rows)):
            images = samples.parts_of(np.stack([image(rows[base], g) for g in group]), points) < 0
            distinct = _distinct(parts[base], images)
            covered = images[distinct].any(axis=0) if distinct else np.zeros(len(points), bool)
            share = (parts & covered).sum(axis=1) / sizes
            share[:locked] = share[base] = 0
            share[rows[:, Column.SIGN] != rows[base, Column.SIGN]] = 0
            replaced = frozenset(np.flatnonzero(share > _COVERED).tolist())
            if replaced:
                result.append(Repeat(base, tuple(group[i] for i in distinct), replaced))
    return sorted(result, key=lambda r: (-len(r.replaced), len(r.isometries)))


def _distinct(base: NDArray[np.bool_], images: NDArray[np.bool_]) -> list[int]:
    """Images (K, N) that are neither where the part itself is nor where an earlier one is."""
    kept: list[int] = []
    for i, one in enumerate(images):
        others = np.concatenate([base[None], images[kept]])
        both, either = (others & one).sum(axis=1), (others | one).sum(axis=1)
        if (both < _SELF * either).all():
            kept.append(i)
    return kept


def _chosen(samples: FitSamples, rows: Rows, wanted: list[Repeat]) -> list[Repeat]:
    """Repeats that get along, those first that cost least of R before a refit."""
    whole = score(samples, rows)
    priced = [(whole - score(samples, expanded(_leaves(rows, [one]))), one) for one in wanted[:_TRIED]]
    chosen: list[tuple[float, Repeat]] = []
    taken: set[int] = set()
    for cost, one in sorted(priced, key=lambda entry: (-len(entry[1].replaced), entry[0])):
        involved = {one.base, *one.replaced}
        if cost <= _UNREFITTED_SCORE_LOSS and not taken & involved:
            chosen.append((cost, one))
            taken |= involved
    return [one for _, one in sorted(chosen, key=lambda entry: entry[0])]


def _leaves(rows: Rows, repeats: Sequence[Repeat]) -> list[RepeatedPart]:
    gone = frozenset[int]().union(*(r.replaced for r in repeats))
    isometries = {r.base: r.isometries for r in repeats}
    return [RepeatedPart(row, isometries.get(i, ())) for i, row in enumerate(rows) if i not in gone]
