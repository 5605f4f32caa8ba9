"""The best of several growths together: groups of parts of one in place of those of another.

Each growth is fortunate in some places of the shape and unfortunate in others. What explains the same place
in two of them can be exchanged, and an exchange is kept where it pays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from partwright.fields.columns import Column
from partwright.superfrusta.merging import folded
from partwright.superfrusta.objective import occupancy_score
from partwright.superfrusta.pruning import neighbours
from partwright.superfrusta.refining import TOUCH_UP, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

Mask = NDArray[np.bool_]

_ALIKE = (0.3, 0.5, 0.7)  # shares of the smaller of two parts from which on they explain the same place
_COVERED = 0.5  # share of a part from which on another may stand in its place
_HOPELESS = 0.02  # of the objective: what is so much worse before its refit is not tried
_TRIED = 8  # exchanges with one other assembly that are refitted at most
_SAME = 1e-4  # of the objective


@dataclass(frozen=True)
class Exchange:
    """Parts that go (M,) and parts of the other assembly that come (K,), and the gain before any refit."""

    out: Mask
    into: Mask
    gain: float


def recombined(
    samples: FitSamples,
    rows: Rows,
    other: Rows,
    settings: Settings,
    value_of: Callable[[Rows], float],
    locked: int = 0,
) -> Rows:
    """Rows with groups of parts exchanged for those of another assembly, as long as their value rises.

    Both begin with the same `locked` parts, which stay.
    """
    other = other[locked:]
    value = value_of(rows)
    alive = np.arange(len(rows))  # which of the parts as they were each row is; -1: one that came
    given, taken = len(rows), np.zeros(len(other), bool)
    for exchange in exchanges(samples, rows, other, settings, locked)[:_TRIED]:
        out = np.flatnonzero(exchange.out)
        if not np.isin(out, alive).all() or (exchange.into & taken).any():
            continue
        gone = np.isin(alive, out) & (alive < given)
        trial = exchanged(samples, rows, other[exchange.into], gone, settings, locked)
        reached = value_of(trial)
        if reached > value + _SAME:
            rows, value = trial, reached
            alive = np.append(alive[~gone], np.full(np.count_nonzero(exchange.into), -1))
            taken |= exchange.into
    return rows


def exchanged(
    samples: FitSamples, rows: Rows, new: Rows, gone: Mask, settings: Settings, locked: int
) -> Rows:
    """The rows less those that are gone, and new ones; these and their neighbours refitted."""
    touched = np.zeros(len(rows), bool)
    for part in np.flatnonzero(gone):
        touched |= neighbours(samples, rows, int(part))
    touched[:locked] = False
    moving = np.append(touched[~gone], np.ones(len(new), bool))
    joined = np.concatenate([rows[~gone], new])
    return refine(samples, joined, TOUCH_UP, settings, moving)


def exchanges(
    samples: FitSamples, rows: Rows, other: Rows, settings: Settings, locked: int
) -> list[Exchange]:
    """Those that may pay, best first."""
    mine, theirs = (samples.covered_by(each, samples.points) for each in (rows, other))
    added = np.concatenate([rows[:, Column.SIGN], other[:, Column.SIGN]]) > 0
    occupied = np.concatenate([mine, theirs])
    whole = float(occupancy_score(samples, folded(mine, added[: len(rows)])))
    found = []
    for out, into in _groups(samples, rows, other, mine, theirs):
        if out[:locked].any():
            continue
        left = np.concatenate([~out, into])
        if not added[left].any():
            continue
        reached = float(occupancy_score(samples, folded(occupied[left], added[left])))
        saved = settings.price * (np.count_nonzero(out) - np.count_nonzero(into))
        gain = reached - whole + float(saved)
        if gain > -_HOPELESS:
            found.append(Exchange(out, into, gain))
    return sorted(found, key=lambda one: -one.gain)


def _groups(
    samples: FitSamples, rows: Rows, other: Rows, mine: Mask, theirs: Mask
) -> list[tuple[Mask, Mask]]:
    """Parts of both that explain the same place: those that overlap, chained; what one of the other covers;
    what covers one of these."""
    weight = samples.weight
    shared = (mine * weight) @ theirs.T.astype(np.float32)
    sizes, others = (np.maximum((each * weight).sum(axis=1), 1e-9) for each in (mine, theirs))
    shared[rows[:, Column.SIGN, None] != other[None, :, Column.SIGN]] = 0
    of_mine, of_theirs = shared / sizes[:, None], shared / others
    found: dict[bytes, tuple[Mask, Mask]] = {}

    def add(out: Mask, into: Mask) -> None:
        if into.any():
            found.setdefault(out.tobytes() + into.tobytes(), (out, into))

    for share in _ALIKE:
        for alike in (np.maximum(of_mine, of_theirs) > share, np.minimum(of_mine, of_theirs) > share):
            n, m = alike.shape
            graph = np.zeros((n + m, n + m), bool)
            graph[:n, n:] = alike
            count, label = connected_components(graph, directed=False)
            for which in range(count):
                add(label[:n] == which, label[n:] == which)
    for part in range(len(other)):
        add(of_mine[:, part] > _COVERED, np.arange(len(other)) == part)
    for part in range(len(rows)):
        add(np.arange(len(rows)) == part, of_theirs[part] > _COVERED)
    return list(found.values())
