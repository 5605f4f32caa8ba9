"""Relations between the numbers of parts, taken as equations from the best supported to the least."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from partwright.cleaning.acceptance import AcceptanceTest
from partwright.cleaning.deviation_samples import State
from partwright.cleaning.features import Family, clusters, families, halves, meaningful
from partwright.cleaning.grid import Grid
from partwright.cleaning.linear import Equations
from partwright.cleaning.orientations import Frames
from partwright.cleaning.patterns import Circle, circles, equal_leaves, mirror_pairs
from partwright.cleaning.refitting import refit

Floats = NDArray[np.float64]

_REACH = 3.0  # tolerances: what is this near is tried as one
_ALIKE = 0.1  # relative difference of dimensions that are tried as one
_PHASE, _PHASE_NEAR = 15.0, 3.0  # degrees
_TYPED = 0.05  # relative change of a dimension that rounding may make
_ITERATIONS = 10
_SHARES = (1.0, 0.5, 0.2)  # of the refit's step
_ROUNDED = 1 / 3  # tolerances that rounding may move a surface: many numbers are rounded at once
_ROUNDINGS = 8  # plain numbers that are tried for one entry


@dataclass(frozen=True)
class Snapped:
    """How far relations were taken on."""

    state: State
    """As they make it."""
    equations: Equations
    """Those that its vector meets."""

    def tried(
        self, acceptance: AcceptanceTest, rows: Sequence[tuple[Floats, float]], same: float
    ) -> Snapped | None:
        """With further equations row @ vector = value, if they agree with the others and cost little."""
        equations: Equations | None = self.equations
        for row, value in rows:
            equations = equations.with_row(row, value, same) if equations is not None else None
        if equations is None:
            return None
        state = acceptance.equations(self.state, equations)
        return None if state is None else Snapped(state, equations)


def snapped(state: State, acceptance: AcceptanceTest, frames: Frames, grid: Grid) -> State:
    """All relations, one refit of what they leave free, and at last plain numbers."""
    reach = _REACH * acceptance.tolerance / state.samples.scale
    now = Snapped(state, _typed(state, grid))
    found = list(circles(state.model, state.vector, frames, reach))
    kept = []
    for circle in found:
        leaves = sorted({int(state.model.leaf_of[c]) for c in circle.copies})
        trial = now.tried(
            acceptance, [*_equal(now.state, leaves), *((row, 0.0) for row in circle.rows)], grid.same
        )
        if trial is not None:
            now = trial
            kept.append(circle)
    for group in equal_leaves(state.model, now.state.vector, reach):
        now = now.tried(acceptance, _equal(now.state, group), grid.same) or now
    for family in families(state.model, frames):
        now = _coinciding(now, acceptance, family, reach, grid.same)
        if family.kind == "centre":
            now = _mirrored(now, acceptance, frames, family, reach, grid.same)
    phases = []
    for circle in kept:
        now, phase = _sensible_phase(now, acceptance, circle, frames, grid.same)
        phases.append((circle, phase))
    now = _refitted(now, acceptance)
    return _rounded(now, acceptance, grid, [c.radius(state.model, frames, p) for c, p in phases]).state


def _typed(state: State, grid: Grid) -> Equations:
    """Orientations are plain already; numbers that somebody may have typed stay."""
    equations: Equations | None = state.model.equations()
    for at, variable in enumerate(state.model.variables):
        ratio = variable.dimension is not None and variable.dimension.ratio
        value = float(state.vector[at])
        if variable.kind == "turn" or grid.plain(value, ratio):
            assert equations is not None
            equations = equations.with_row(_unit(len(state.vector), at), value, grid.same)
    assert equations is not None
    return equations


def _unit(count: int, at: int) -> Floats:
    row = np.zeros(count)
    row[at] = 1.0
    return row


def _equal(state: State, leaves: Sequence[int]) -> list[tuple[Floats, float]]:
    """Equations that make leaves of one kind equal."""
    first = state.model.numbers(leaves[0])
    rows = []
    for leaf in leaves[1:]:
        for a, b in zip(first, state.model.numbers(leaf), strict=True):
            rows.append((_unit(len(state.vector), a) - _unit(len(state.vector), b), 0.0))
    return rows


def _coinciding(
    now: Snapped, acceptance: AcceptanceTest, family: Family, reach: float, same: float
) -> Snapped:
    """The largest clusters first; one that costs too much is parted at its widest gap."""
    relative = _ALIKE if family.kind == "number" else 0.0
    pending = clusters(family.members, now.state.vector, reach, relative)
    while pending:
        group = pending.pop(0)
        if len(group) < 2 or not meaningful(family, group):
            continue
        anchor = next((one for one in group if one.owner is None), group[0])
        rows = [(one.row - anchor.row, 0.0) for one in group if one is not anchor]
        trial = now.tried(acceptance, rows, same)
        if trial is not None:
            now = trial
        elif len(group) > 2:
            group = sorted(group, key=lambda one: one.value(now.state.vector))
            pending += halves(group, now.state.vector)
    return now


def _mirrored(
    now: Snapped, acceptance: AcceptanceTest, frames: Frames, family: Family, reach: float, same: float
) -> Snapped:
    """Pairs of equal parts on both sides of a plane through centres."""
    assert family.axis is not None
    frame, axis = frames.find(family.axis)
    planes = [group[0] for group in clusters(family.members, now.state.vector, same)]
    planes = [*(one for one in family.members if one.owner is None), *planes]
    for _, _, row in mirror_pairs(now.state.model, now.state.vector, frames, planes, axis, frame, reach):
        now = now.tried(acceptance, [(row, 0.0)], same) or now
    return now


def _sensible_phase(
    now: Snapped, acceptance: AcceptanceTest, circle: Circle, frames: Frames, same: float
) -> tuple[Snapped, float]:
    """A circle's first copy at a multiple of 15 degrees, if near; and its angle then."""
    model = now.state.model
    across, along = circle.radius(model, frames, 0.0)
    phase = float(np.degrees(np.arctan2(along @ now.state.vector, across @ now.state.vector)))
    rounded = round(phase / _PHASE) * _PHASE
    if abs(rounded - phase) <= _PHASE_NEAR:
        _, off = circle.radius(model, frames, rounded)
        trial = now.tried(acceptance, [(off, 0.0)], same)
        if trial is not None:
            return trial, rounded
    return now, phase


def _refitted(now: Snapped, acceptance: AcceptanceTest) -> Snapped:
    """As far towards the least squares as no part gets worse than it may."""
    locked = np.array([v.kind == "turn" for v in now.state.model.variables])
    step = refit(now.state, now.equations.freedom(locked), _ITERATIONS).vector - now.state.vector
    for share in _SHARES:
        equations = dataclasses.replace(now.equations, vector=now.state.vector + share * step)
        better = acceptance.equations(now.state, equations)
        if better is not None:
            return Snapped(better, equations)
    return now


def _rounded(
    now: Snapped, acceptance: AcceptanceTest, grid: Grid, radii: Sequence[tuple[Floats, Floats]]
) -> Snapped:
    """Dimensions, radii of circles and places at the plainest numbers that cost little enough; at the finest
    whatever they cost, so that all are plain in the end."""
    tolerance = _ROUNDED * acceptance.tolerance / now.state.samples.scale
    free = acceptance.without_limit()
    for row, limit, ratio in _entries(now, radii, tolerance):
        if now.equations.determined(row):
            continue
        value = float(row @ now.state.vector)
        near = islice(grid.nearest(value, limit, ratio), _ROUNDINGS)
        tries = ((acceptance, rounded) for rounded in near)
        rest = ((free, rounded) for rounded in grid.finest(value, ratio))
        trials = (now.tried(who, [(row, rounded)], grid.same) for who, rounded in chain(tries, rest))
        now = next((trial for trial in trials if trial is not None), now)
    return now


def _entries(
    now: Snapped, radii: Sequence[tuple[Floats, Floats]], tolerance: float
) -> Iterator[tuple[Floats, float, bool]]:
    """Rows to round, how far each may go, and whether it is a ratio."""
    model, count = now.state.model, len(now.state.vector)
    for at, variable in enumerate(model.variables):
        if variable.dimension is not None:
            ratio = variable.dimension.ratio
            limit = tolerance / variable.weight
            value = abs(float(now.state.vector[at]))
            yield _unit(count, at), min(limit, _TYPED if ratio else _TYPED * value), ratio
    for radius, _ in radii:
        yield radius, tolerance, False
    for at, variable in enumerate(model.variables):
        if variable.kind == "place":
            yield _unit(count, at), tolerance, False
