"""The last steps of a fit: all parts move at once by what is felt at a look, overlaps and largest deviations.

A deviation is a length, the largest of many. Occupancies, whatever their weights, hardly tell 3 from 2 %, so
here the steps of the overlaps' normal equations bend to the slopes of the lengths themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from partwright.at_once import both
from partwright.fields import kernel
from partwright.fields.columns import Column
from partwright.fields.kernel import Target
from partwright.shapes import Shape
from partwright.superfrusta.close_look import CloseLook, Seen
from partwright.superfrusta.deviations import largest, norm, places
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.refining import penalties, sharpened
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import LeafSteps, RepeatedPart, expanded

Floats = NDArray[np.float64]
Equations = tuple[Floats, Floats]

_SHARPNESS = 100.0  # of the sigmoid, for solids of ordinary thickness
# What the loss of overlaps counts beside lengths: it goes with the square of what is wrong, and near the best
# falls far less than R rises. How much less differs, so they take turns.
_SCALES = (30.0, 10.0)
_POWER = 16.0  # by which points of a place count: those within a quarter of the furthest, more or less
_LEAST_SHARE = 0.01  # of what the furthest counts
_LINEAR = 4.0  # sharpness at which an occupancy near the surface is the distance, but for its sign
_LEAST_OFF = 1e-4  # unit lengths
_GAIN = 2e-5  # of the value, from which on a step is taken
_FIRMER = 2.5  # times the settings' price on lengths: what is seen counts more, once all parts are there
_GLARING = 0.08  # unit lengths: 2.5 % of the longest side outwards, or 4.5 % that is missing
_GLARES = 2.0  # price on each unit length beyond, place by place: worth several parts, which the norm is not
SPENT = 5e-3  # of R, at most, for lengths
_OVERLAP = 0.01  # of what parts cover: so much more may be covered twice, which thin shapes hardly feel
_LEAST_DAMPING = 1e-3
_TRIES = 4  # of one scale: a step that is damped a thousand times more follows the slope alone
_STIFFNESS = 1e-4  # added to the diagonal: what neither feels stays
MOST_COPIES = 200  # the normal equations grow with their square


def last_polished(
    shape: Shape,
    samples: FitSamples,
    leaves: list[RepeatedPart],
    settings: Settings,
    moving: NDArray[np.bool_],
) -> list[RepeatedPart]:
    """Leaves, those `moving` (L,) moved together, copies of each as one, while R less a price on how far they
    are off rises; at most `settings.looks` assemblies are looked at.

    R does not fall by more than five thousandths, nor below an IoU that the settings ask for.
    """
    rows = expanded(leaves)
    if not settings.looks or not moving.any() or len(rows) > MOST_COPIES:
        return leaves
    polish = Polish(CloseLook.at(shape, samples), settings, LeafSteps.of(leaves, settings, moving))
    found = polish.best(np.stack([leaf.row for leaf in leaves]))
    polished = [RepeatedPart(row, leaf.isometries) for row, leaf in zip(found, leaves, strict=True)]
    if settings.min_iou is not None:
        least = min(settings.min_iou, volume_iou(samples, rows))
        if volume_iou(samples, expanded(polished)) < least:
            return leaves
    return polished


@dataclass(frozen=True)
class Damping:
    """Of the first step, and times as much after a step that gains, and after one that does not."""

    first: float
    less: float
    more: float


LASTING, BRIEF = Damping(0.1, 0.1, 10.0), Damping(1.0, 0.7, 3.0)  # for many looks, and for a few


@dataclass(frozen=True)
class Trial:
    """Leaves (L, 17), where their copies are off, and what they are worth.

    place: (n,) that each point belongs to. by_place: (P,) how far a leaf is off there.
    """

    rows: Rows
    off: Seen
    place: NDArray[np.int64]
    by_place: Floats
    score: float
    value: float


@dataclass
class Polish:
    look: CloseLook
    settings: Settings
    steps: LeafSteps
    damped: Damping = LASTING
    looks: int = field(default=0, init=False)

    @property
    def firmness(self) -> float:
        """Price on each unit length that leaves are off."""
        return _FIRMER * self.settings.firmness

    def trial(self, rows: Rows) -> Trial:
        self.looks += 1
        copies, samples = self.steps.copies(rows), self.look.samples
        looked, scored = partial(self.look.deviations, copies), partial(score, samples, copies)
        off, reached = both(looked, scored, samples.threads)
        place = places(self.steps.leaf[off.part], off.points)
        furthest = largest(place, off.off)
        glaring = float(np.maximum(furthest - _GLARING, 0).sum())
        price = self.firmness * norm(furthest) + _GLARES * glaring
        return Trial(rows, off, place, furthest, reached, reached - price)

    def best(self, rows: Rows) -> Rows:
        """The leaves' rows (L, 17) after steps that gain."""
        return self.further(self.trial(rows)).rows

    def further(self, best: Trial, hopeless: float = -np.inf) -> Trial:
        """What steps that gain make of leaves that have been looked at; given up after half of the looks
        where their value is `hopeless` still."""
        least, most = best.score - SPENT, self.overlap(best.rows) + _OVERLAP
        damping = dict.fromkeys(_SCALES, self.damped.first)
        vain = 0  # scales in a row
        for scale in cycle(_SCALES):
            given_up = 2 * self.looks > self.settings.looks and best.value < hopeless
            if not len(best.by_place) or vain == len(_SCALES) or given_up:
                break
            if not vain:
                terms = partial(self.overlaps, best), partial(self.lengths, best)
                overlaps, lengths = both(*terms, self.look.samples.threads)
            gradient, matrix = (scale * one + other for one, other in zip(overlaps, lengths, strict=True))
            stiff = np.diag(np.diag(matrix) + _STIFFNESS)
            vain += 1
            for _ in range(min(_TRIES, self.settings.looks - self.looks)):
                step = np.asarray(-np.linalg.solve(matrix + damping[scale] * stiff, gradient), np.float64)
                trial = self.trial(self.steps.taken(best.rows, step))
                gains = trial.value > best.value + _GAIN and trial.score >= least
                if gains and self.overlap(trial.rows) <= most:
                    damping[scale] = max(self.damped.less * damping[scale], _LEAST_DAMPING)
                    best, vain = trial, 0
                    break
                damping[scale] *= self.damped.more
        return best

    def overlap(self, rows: Rows) -> float:
        """Share of what parts that are added cover that more than one does."""
        samples, copies = self.look.samples, self.steps.copies(rows)
        covers = samples.covered_by(copies[copies[:, Column.SIGN] > 0], samples.points[samples.near :])
        count = np.count_nonzero(covers, axis=0)
        return int((count > 1).sum()) / max(int((count > 0).sum()), 1)

    def overlaps(self, at: Trial) -> Equations:
        """Gradient and matrix of what optimisation minimises."""
        samples = self.look.samples
        ((beta, _),) = sharpened(((_SHARPNESS, 1),), samples.thickness)
        target = samples.target(samples.optimised_indices)
        _, gradient, matrix = samples.kernel.normal_equations(
            self.steps.copies(at.rows), target, float(beta), penalties(self.settings), samples.threads
        )
        return self.steps.projected(gradient, matrix)

    def lengths(self, at: Trial) -> Equations:
        """Gradient of the price on how far leaves are off, and the matrix of the least squares whose weights
        give it. Of a place those points count that are nearly the furthest."""
        samples, off, copies = self.look.samples, at.off, self.steps.copies(at.rows)
        share = (off.off / at.by_place[at.place]) ** _POWER
        felt = np.flatnonzero(share > _LEAST_SHARE)
        place = at.place[felt]
        in_all = np.bincount(place, share[felt], len(at.by_place))
        of_place = self.firmness * (at.by_place / norm(at.by_place)) ** 3
        price = of_place[place] * share[felt] / in_all[place]
        points, outside = off.points[felt], off.distance[felt] > 0
        slope = price * np.where(outside, -1.0, 1.0) * off.times[felt]  # of the price by the field
        gradient = kernel.gradients(copies, points, slope.astype(np.float32), samples.threads)
        weight = (np.abs(slope) / np.maximum(off.off[felt], _LEAST_OFF)).astype(np.float32)
        # An occupancy's slope is a quarter of its sharpness.
        there = samples.distance_of(copies, points)
        target = Target(points, there, weight * np.float32((4 / _LINEAR) ** 2))
        _, _, matrix = samples.kernel.normal_equations(copies, target, _LINEAR, threads=samples.threads)
        return self.steps.projected(gradient.ravel(), matrix)
