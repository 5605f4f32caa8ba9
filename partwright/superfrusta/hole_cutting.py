"""Holes of a pattern as one part that is subtracted, with copies, from all that is there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial.transform import Rotation

from partwright.fields.columns import Column
from partwright.superfrusta.families import locked_values, with_locked_values
from partwright.superfrusta.hole_patterns import HolePattern
from partwright.superfrusta.objective import score
from partwright.superfrusta.refining import POLISH, refine
from partwright.superfrusta.repeated_parts import Trial, measured
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded, refit

Floats = NDArray[np.float64]

_STAGES = ((40.0, 4), (100.0, 8), (200.0, 8))
_NEAR = 2  # voxels from a hole
_MOST_REFITTED = 200  # copies: the normal equations grow with their square
_BEYOND = 0.03  # unit lengths that a cut goes on where the hole ends in the open
_LOOKED = 0.03  # unit lengths from a hole's end at which it is open or not
_PRICE = 0.5  # of a part's: a hole that holds too little to pay for one is seen as well as another part is
_ROUNDNESS = (0.05, 0.95)  # of a box and of a rod, free to move either way
_BLEND = 0.01  # unit lengths
_SECTION = 0.25  # of its depth, from the middle: sections as far stand for what lies beyond its ends


def with_holes(
    samples: FitSamples,
    leaves: Sequence[RepeatedPart],
    patterns: Sequence[HolePattern],
    settings: Settings,
    locked: int = 0,
) -> list[RepeatedPart]:
    """Leaves with those patterns cut out of them that are worth a part, all refitted; the same leaves where
    none is."""
    cuts = [RepeatedPart(hole_part(samples, one, settings), one.isometries) for one in patterns]
    best = as_found = _measured(samples, list(leaves), settings)
    # What is there was fitted to voxels where holes were full, or was set back for what it covered.
    beside = refit(_beside(samples, patterns), leaves, _STAGES, settings, locked)
    for trial in (as_found, _measured(samples, beside, settings)):
        with_cuts = trial
        for cut in cuts:
            with_cuts = _better(with_cuts, _measured(samples, [*with_cuts.leaves, cut], settings))
        if with_cuts is not trial:
            best = _better(best, with_cuts)
    if len(leaves) < len(best.leaves) and len(expanded(best.leaves)) <= _MOST_REFITTED:
        fitted = refit(samples, best.leaves, _STAGES, settings, locked)
        best = _better(best, _measured(samples, fitted, settings))
    return best.leaves


def _measured(samples: FitSamples, leaves: list[RepeatedPart], settings: Settings) -> Trial:
    return measured(samples, leaves, settings, _PRICE)


def _better(one: Trial, other: Trial) -> Trial:
    return other if other.value > one.value else one


def _beside(samples: FitSamples, patterns: Sequence[HolePattern]) -> FitSamples:
    """Samples of which those near a hole count for nothing."""
    filling = np.any([pattern.filling for pattern in patterns], axis=0)
    near = ndimage.binary_dilation(filling, np.ones((3, 3, 3)), iterations=_NEAR).ravel()
    return replace(samples, weight=np.where(near[samples.voxel], np.float32(0), samples.weight))


def hole_part(samples: FitSamples, pattern: HolePattern, settings: Settings) -> NDArray[np.float32]:
    """The part (17,) to subtract for a pattern's hole: what fits the hole as a body, a little longer.

    Begun as a box and as a rod, for growth's many starts are made for larger regions.
    """
    body, middle, half = _body(samples, pattern)
    room = np.abs(pattern.frame) @ half
    local = body.about(middle - room, middle + room)
    turn = Rotation.from_matrix(pattern.frame).as_quat(scalar_first=True)
    shapes = [[*2 * half, roundness, 0.0, 1.0, 0.0, 0.0, _BLEND] for roundness in _ROUNDNESS]
    rows = np.array([[*middle, *turn, *shape, 1.0] for shape in shapes], np.float32)
    rows = with_locked_values(rows, locked_values(settings.family, settings.smooth))
    fitted = [refine(local, row[None], POLISH, settings) for row in rows]
    part = max(fitted, key=lambda rows: score(local, rows))[0]
    part[Column.SIGN] = -1
    return part


def _body(samples: FitSamples, pattern: HolePattern) -> tuple[FitSamples, Floats, Floats]:
    """No samples yet, of the hole as a body, its middle (3,) and half of its extents (3,) in its frame. Where
    it ends in the open it goes on a little, in the section that it has within the shape."""
    along = pattern.frame[:, 2]
    at = samples.grid.points_of(np.flatnonzero(pattern.hole))
    low, high = (end((at - at.mean(axis=0)) @ pattern.frame, axis=0) for end in (np.min, np.max))
    middle = at.mean(axis=0) + pattern.frame @ ((low + high) / 2)
    half = (high - low) / 2 + samples.grid.spacing / 2
    ends = middle + np.outer([-1, 1], (half[2] + _LOOKED) * along)
    open_ = samples.measure(ends.astype(np.float32)) > 0
    section = np.where(open_, _SECTION * half[2], np.inf)
    reach = half[2] + np.where(open_, _BEYOND, samples.grid.spacing)
    aside = half[:2] + samples.grid.spacing / 2

    def distance(points: NDArray[np.float32]) -> NDArray[np.float32]:
        own = (points - middle) @ pattern.frame
        z = own[:, 2]
        seen = points + (np.clip(z, -section[0], section[1]) - z)[:, None] * along
        off = [-samples.measure(seen.astype(np.float32)), -reach[0] - z, z - reach[1]]
        return np.maximum.reduce([*off, *(np.abs(own[:, :2]) - aside).T]).astype(np.float32)

    none = samples.points[:0]
    body = replace(
        samples, measure=distance, points=none, distance=none[:, 0], weight=none[:, 0], near=0, probes=none
    )
    return body, middle + (reach[1] - reach[0]) / 2 * along, np.array([*half[:2], reach.mean()])
