"""Which quadrics, in which convexes, in which layers: the selection matrix T (section 3.2) by search.

The gradient of a relaxed T needs tens of thousands of steps to become binary. With quadrics that lie on the
surface, T is a problem of logic instead: find few conjunctions of half-spaces ("convexes") whose layers
(added, subtracted, added ...) give every sample its side. Every move (add, drop or exchange a quadric; add or
drop a convex) changes the objective by a sum over the samples: one matrix product gives it for all quadrics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

Convex = tuple[int, ...]
Layers = list[list[Convex]]
Matrix = NDArray[np.float32]
Move = tuple[int | None, int | None]  # which of the chosen to drop, which quadric to add

_SEED_SAMPLES = 24
_COARSE_SAMPLES = 6000  # samples on which seeds compete
_MAX_IMPROVED = 3
_MAX_CACHED_CONVEXES = 1000
FALSE_POSITIVE_WEIGHTS = (0.3, 1.0, 3.0, 10.0)
_MIN_RELATIVE_PROGRESS = 1e-3  # of the cost, below which polishing ends
_MIN_GAIN = 1e-3  # of a sample's least weight


@dataclass(frozen=True)
class Problem:
    """outside (N, K) float32: 1 where quadric k leaves sample n out; inside (N,) bool: the shape's own side;
    weight (N,): what a sample on the wrong side costs; all of the shape's inside costs 1.

    price (K,), convex_price: what each quadric and a convex cost (the description length). pause: called
    before each local search; where it raises, the search ends.
    """

    outside: NDArray[np.float32]
    inside: NDArray[np.bool_]
    weight: NDArray[np.float32]
    price: NDArray[np.float64]
    convex_price: float
    rng: np.random.Generator = field(repr=False)
    pause: Callable[[], None] | None = field(default=None, repr=False)
    known: dict[Convex, NDArray[np.bool_]] = field(default_factory=dict, repr=False)

    def step(self) -> None:
        if self.pause is not None:
            self.pause()

    def covered(self, convex: Convex) -> NDArray[np.bool_]:
        """(N,) samples within a convex."""
        if convex not in self.known:
            if len(self.known) >= _MAX_CACHED_CONVEXES:
                self.known.clear()
            self.known[convex] = np.asarray(~self.outside[:, list(convex)].any(axis=1))
        return self.known[convex]

    def occupancy(self, layers: Layers) -> NDArray[np.bool_]:
        """(N,) the side that the layers give each sample."""
        result = np.zeros(len(self.inside), dtype=bool)
        for k, layer in enumerate(layers):
            for convex in layer:
                result[self.covered(convex)] = k % 2 == 0
        return result

    def error(self, layers: Layers) -> float:
        """Weight of the samples on the wrong side."""
        return float(self.weight[self.occupancy(layers) != self.inside].sum())

    def cost(self, layers: Layers) -> float:
        """The objective: error plus description length."""
        return self.error(layers) + sum(self.length(convex) for layer in layers for convex in layer)

    def length(self, convex: Convex) -> float:
        """What a convex costs."""
        return float(self.price[list(convex)].sum()) + self.convex_price

    def error_reduction(
        self, layers: Layers, at: int, without: int | None = None, false_positive_weight: float = 1.0
    ) -> Matrix:
        """(N,) by how much the error falls where a convex in layer `at` covers a sample.

        without: index in that layer of a convex to leave out. false_positive_weight: how many times a sample
        counts that the convex would put on the wrong side.
        """
        before = np.zeros(len(self.inside), dtype=bool)
        for k in range(at + 1):
            for i, convex in enumerate(layers[k]):
                if k != at or i != without:
                    before[self.covered(convex)] = k % 2 == 0
        free = np.ones(len(self.inside), dtype=bool)
        for layer in layers[at + 1 :]:
            for convex in layer:
                free &= ~self.covered(convex)
        painted = at % 2 == 0
        change = free & (before != painted)
        right = self.inside == painted
        value = np.where(right, self.weight, -np.rint(false_positive_weight * self.weight))
        return np.where(change, value, 0).astype(np.float32)


def improve(problem: Problem, outside: Matrix, reduction: Matrix, convex: Convex) -> tuple[Convex, float]:
    """Local search over one convex: adds, drops, exchanges while its value rises; the convex, its value.

    outside (N, K) and reduction (N,) of the error: the samples at which it matters whether the convex covers
    them. What each quadric would take from the convex is kept up to date by the samples that a move changes:
    weights are whole numbers, so the sums stay exact.
    """
    problem.step()
    chosen = list(convex)
    count = outside[:, chosen].sum(axis=1)
    taken = _sums(outside, reduction, count == 0)
    while True:
        gain = -taken - problem.price
        gain[chosen] = -np.inf
        best_add = int(np.argmax(gain))
        best, move = float(gain[best_add]), cast(Move, (None, best_add))
        single = np.flatnonzero(count == 1)
        alone = outside[np.ix_(single, np.array(chosen, dtype=np.int64))] > 0
        if chosen:
            back = reduction[single] @ alone + problem.price[chosen]
            if back.max() > best:
                best, move = float(back.max()), (int(np.argmax(back)), None)
        if best <= _MIN_GAIN:
            opened = [single[alone[:, i]] for i in range(len(chosen))]
            best, move = _exchange(problem, outside, reduction, chosen, taken, opened)
            if best <= _MIN_GAIN:
                break
        drop, add = move
        if drop is not None:
            taken += _sums(outside, reduction, single[alone[:, drop]])
            count -= outside[:, chosen.pop(drop)]
        if add is not None:
            taken -= _sums(outside, reduction, (count == 0) & (outside[:, add] > 0))
            chosen.append(add)
            count += outside[:, add]
    convex = tuple(sorted(chosen))
    return convex, float(reduction[count == 0].sum()) - problem.length(convex)


def _sums(outside: Matrix, reduction: Matrix, which: NDArray[Any]) -> Matrix:
    """(K,) summed reduction of the samples `which` (indices or mask) that each quadric leaves out."""
    return np.asarray(reduction[which] @ outside[which])


def _exchange(
    problem: Problem,
    outside: Matrix,
    reduction: Matrix,
    chosen: list[int],
    taken: Matrix,
    opened: list[NDArray[np.int64]],
) -> tuple[float, Move]:
    """The best exchange of one quadric for another, and its gain.

    taken (K,): error reduction of the covered samples that each quadric leaves out; opened: for each chosen
    quadric the samples that it alone leaves out.
    """
    best: float = 0.0
    move: Move = (None, None)
    for i, (k, rows) in enumerate(zip(chosen, opened, strict=True)):
        back = float(reduction[rows].sum()) + problem.price[k]
        gain = back - taken - _sums(outside, reduction, rows) - problem.price
        gain[chosen] = -np.inf
        add = int(np.argmax(gain))
        if gain[add] > best:
            best, move = float(gain[add]), (i, add)
    return best, move


def grown(
    problem: Problem,
    outside: Matrix,
    reduction: Matrix,
    allowed: NDArray[np.bool_],
    known: dict[Convex, Matrix],
) -> Convex:
    """A convex grown from all of space: the allowed quadrics (K,) join, best first, while that pays.

    known: what each quadric (K,) would take from a convex of those that joined, in their order; added to.
    Many seeds pass through the same convexes.
    """
    problem.step()
    chosen: Convex = ()
    while True:
        if chosen not in known:
            covered = np.asarray(~outside[:, list(chosen)].any(axis=1))
            known[chosen] = _sums(outside, reduction, covered)
        gain = np.where(allowed, -known[chosen] - problem.price, -np.inf)
        gain[list(chosen)] = -np.inf
        add = int(np.argmax(gain))
        if gain[add] <= _MIN_GAIN:
            return chosen
        chosen = (*chosen, add)


def best_convex(problem: Problem, reduction: NDArray[np.float32]) -> tuple[Convex, float]:
    """The most valuable convex that the search finds for samples that reduce the error by this much."""
    rows = np.flatnonzero(reduction)
    wanted = rows[reduction[rows] > 0]
    if len(wanted) == 0:
        return (), 0.0
    rng = problem.rng
    coarse = rows if len(rows) <= _COARSE_SAMPLES else rng.choice(rows, _COARSE_SAMPLES, replace=False)
    scale = np.float32(len(rows) / len(coarse))
    outside, value = problem.outside[coarse], reduction[coarse] * scale
    share = reduction[wanted].astype(np.float64)
    seeds = rng.choice(wanted, min(_SEED_SAMPLES, len(wanted)), replace=False, p=share / share.sum())
    tried: dict[Convex, float] = {}
    known: dict[Convex, Matrix] = {}
    for seed in seeds:
        convex = tuple(sorted(grown(problem, outside, value, problem.outside[seed] == 0, known)))
        if convex not in tried:
            cover = ~outside[:, list(convex)].any(axis=1)
            tried[convex] = float(value[cover].sum()) - problem.length(convex)
    best: tuple[Convex, float] = (), 0.0
    full, reductions = problem.outside[rows], reduction[rows]
    for convex in sorted(tried, key=lambda c: -tried[c])[:_MAX_IMPROVED]:
        found = improve(problem, full, reductions, convex)
        if found[1] > best[1] and found[0]:
            best = found
    return best


def fill(problem: Problem, layers: Layers, false_positive_weight: float, most: int) -> Layers:
    """Convexes added layer by layer while they pay; all layers but the last judge by `false_positive_weight`.

    Under 1 it forgives what the next layer may take away again; above, convexes stay within the shape.
    """
    filled = [list(layer) for layer in layers]
    for at in range(len(filled)):
        weight = false_positive_weight if at + 1 < len(filled) else 1.0
        while sum(map(len, filled)) < most:
            convex, value = best_convex(
                problem, problem.error_reduction(filled, at, false_positive_weight=weight)
            )
            if value <= 0:
                break
            filled[at].append(convex)
    return filled


def polish(problem: Problem, layers: Layers, most: int, rounds: int = 6) -> Layers:
    """Local search over all layers: every convex anew given the others, then new ones, until nothing pays."""
    layers = [list(layer) for layer in layers]
    cost = np.inf
    for _ in range(rounds):
        for at, layer in enumerate(layers):
            for i in reversed(range(len(layer))):
                reduction = problem.error_reduction(layers, at, without=i)
                rows = np.flatnonzero(reduction)
                convex, value = improve(problem, problem.outside[rows], reduction[rows], layer[i])
                if value > 0 and convex:
                    layer[i] = convex
                else:
                    layer.pop(i)
        while sum(map(len, layers)) < most:
            options = [
                (*best_convex(problem, problem.error_reduction(layers, at)), at) for at in range(len(layers))
            ]
            convex, value, at = max(options, key=lambda option: option[1])
            if value <= 0:
                break
            layers[at].append(convex)
        now = problem.cost(layers)
        if now > cost * (1 - _MIN_RELATIVE_PROGRESS):
            break
        cost = now
    return layers


def ruin_and_recreate(problem: Problem, layers: Layers, most: int) -> Layers:
    """Takes out convexes around a sample on the wrong side and fills the gap anew (Schrimpf et al. 2000).

    Returns what came of it if it is cheaper, else the layers as they were.
    """
    wrong = np.flatnonzero(problem.occupancy(layers) != problem.inside)
    weight = problem.weight[wrong].astype(np.float64)
    if weight.sum() == 0:
        return layers
    sample = int(problem.rng.choice(wrong, p=weight / weight.sum()))
    false_positive_weight = float(problem.rng.choice(FALSE_POSITIVE_WEIGHTS))
    tried = fill(problem, _ruined(problem, layers, sample), false_positive_weight, most)
    tried = polish(problem, tried, most, rounds=2)
    return tried if problem.cost(tried) < problem.cost(layers) else layers


def _ruined(problem: Problem, layers: Layers, sample: int) -> Layers:
    """Without at most three convexes: those that hold the sample, or nearly do."""
    outside = problem.outside[sample]
    near = sorted(
        (float(outside[list(convex)].sum()) + problem.rng.random(), at, i)
        for at, layer in enumerate(layers)
        for i, convex in enumerate(layer)
    )
    gone = {(at, i) for _, at, i in near[: int(problem.rng.integers(0, 4))]}
    return [[c for i, c in enumerate(layer) if (at, i) not in gone] for at, layer in enumerate(layers)]
