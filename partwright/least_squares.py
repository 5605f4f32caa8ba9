"""Damped least squares (Levenberg 1944, Marquardt 1963): one loop for whatever has normal equations.

The loop knows nothing of what it moves. A problem says how its residuals look from a state (`linearise`),
what a state costs (`loss`), and where a step leads from one (`move`, which clips, projects, and may say that
there is no such state). A step that does not lower the loss is refused and tried again with more damping.

The compiled kernel has a loop of its own in C++ (cpp/optimise.cpp), and `superfrusta.torch_kernel` one that
runs a batch of fits on a device.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
State = TypeVar("State")


@dataclass(frozen=True)
class Damping:
    """How steps are damped, and when to stop."""

    trials: int
    """At most so many steps are tried, accepted or not."""
    start: float = 1e-2
    """Damping of the first step, as a share of the matrix's diagonal."""
    down: float = 0.3
    """Factor after a step that is accepted."""
    up: float = 5.0
    """Factor after one that is refused."""
    least: float = 0.0
    """The damping never falls below."""
    floor: float = 0.0
    """Added to the diagonal before it is multiplied by the damping: what has no influence stays in place."""
    ridge: float = 1e-9
    """Added to the diagonal whatever the damping: the matrix can always be solved."""
    settled: float = 0.0
    """A step that lowers the loss by less than this share of it is the last."""
    steps: int | None = None
    """At most so many steps are accepted (None: as many as are tried)."""
    refusals: int | None = None
    """So many refusals in a row end it (None: none do)."""


@dataclass(frozen=True)
class Minimum(Generic[State]):
    """Where the loop ended, the damping that it would go on with, and how many steps it took."""

    state: State
    damping: float
    steps: int


def minimise(
    state: State,
    linearise: Callable[[State], tuple[float, Floats, Floats]],
    loss: Callable[[State], float],
    move: Callable[[State, Floats], State | None],
    damping: Damping,
    cancelled: Callable[[], bool] = lambda: False,
) -> Minimum[State]:
    """The state of least loss that damped Gauss-Newton steps lead to; the loss never rises.

    linearise: loss, gradient J^T r (n,) and matrix J^T J (n, n) at a state; any common factor of the last two
    leaves the steps as they are, but for `floor` and `ridge`. loss: the same loss alone. move: the state
    after a step (n,), or None where there is none; such a step is refused, as one is whose loss is no number.
    cancelled: asked before each trial; once true, the best so far is the result.
    """
    amount, accepted, refused = damping.start, 0, 0
    system: tuple[float, Floats, Floats] | None = None
    for _ in range(damping.trials):
        if cancelled():
            break
        if system is None:
            system = linearise(state)
        value, gradient, matrix = system
        trial = move(state, damped_step(gradient, matrix, amount, damping))
        reached = math.inf if trial is None else loss(trial)
        if trial is None or not reached < value:
            amount, refused = amount * damping.up, refused + 1
            if refused == damping.refusals:
                break
            continue
        state, system, accepted, refused = trial, None, accepted + 1, 0
        amount = max(amount * damping.down, damping.least)
        if accepted == damping.steps or value - reached < damping.settled * value:
            break
    return Minimum(state, amount, accepted)


def damped_step(gradient: Floats, matrix: Floats, amount: float, damping: Damping) -> Floats:
    """The step (n,) that solves (matrix + D) step = -gradient, D diagonal."""
    damped = matrix.copy()
    diagonal = np.diagonal(matrix)
    damped[np.diag_indices_from(damped)] += amount * (diagonal + damping.floor) + damping.ridge
    return np.asarray(np.linalg.solve(damped, -gradient), dtype=np.float64)
