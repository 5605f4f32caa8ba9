"""The search: steps within a trust region, each on a surface that is meshed anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from partwright.assembly import Assembly
from partwright.errors import CancelledError, ObjectiveError, SettingError
from partwright.goals.problem import Point, Problem
from partwright.goals.step import PENALTY, best_step
from partwright.methods import Cancellation, Checkpoint

Ending = Literal["converged", "budget_reached", "interrupted", "left_trained_region", "failed"]

_RADIUS, _WIDEST, _LEAST = 0.02, 0.06, 2e-4  # of the trust region, as shares of the longest side
_GROW, _SHRINK = 1.5, 0.4
_PATIENCE, _GAIN = 6, 5e-4  # accepted steps that together gain less than this share end the search
_MARGIN = 1e-9
_NOTHING = 1e-6  # of the objective, along the whole longest side: rounding


@dataclass(frozen=True)
class Step:
    """One surface that was tried. numbers: what each objective and bound measures; empty where there is none.

    broken: by how much the worst constraint is, as a share; 0 where all are kept. assembly: None where
    nothing was left of it.
    """

    number: int
    of: int
    accepted: bool
    value: float
    broken: float
    radius: float
    numbers: dict[str, float]
    assembly: Assembly | None = field(default=None, compare=False, repr=False)


@dataclass
class Found:
    """The points that were accepted, from the start to the best, and how it ended."""

    points: list[Point]
    steps: list[Step]
    ending: Ending = "budget_reached"
    reason: str = ""
    gradient_seconds: float = field(default=0.0)


def search(
    problem: Problem, told: Callable[[Step], None] | None = None, cancel: Cancellation | None = None
) -> Found:
    """The best point within the options' steps.

    Raises:
        ObjectiveError: an objective cannot be measured at the start; later, the best so far is kept.
        SettingError: no number that is free changes any objective.
    """
    checkpoint = Checkpoint(cancel or Cancellation())
    begin = problem.at(np.zeros(len(problem.parameters)))
    if begin is None:
        raise SettingError("the assembly has no surface at this resolution")
    found = Found([begin], [_told(0, problem, begin, True, _RADIUS, told)])
    try:
        found.ending = _run(problem, found, checkpoint, told)
    except CancelledError:
        found.ending = "interrupted"
    except ObjectiveError as error:
        found.ending, found.reason = "failed", str(error)
    return found


def _run(
    problem: Problem, found: Found, checkpoint: Checkpoint, told: Callable[[Step], None] | None
) -> Ending:
    radius, now = _RADIUS, found.points[0]
    slope, jacobian = problem.slopes(now)
    bent: np.ndarray | None = None  # by how much more than foreseen the refused step broke
    if not np.abs(slope).max() > _NOTHING and not (now.broken > 0).any():
        raise SettingError(
            "no number that is free changes an objective: free other parts, or give another objective"
        )
    for number in range(1, problem.options.steps + 1):
        checkpoint()
        room = problem.lower - now.change, problem.upper - now.change
        lower, upper = (np.where(problem.free, side, 0.0) for side in room)
        broken = now.broken if bent is None else now.broken + bent
        step = best_step(slope, broken, jacobian, np.minimum(lower, 0), np.maximum(upper, 0), radius)
        if np.abs(step).max() < _LEAST / 10:
            if bent is None:
                return "converged"
            bent, radius = None, _SHRINK * radius
            continue
        point = problem.at(now.change + step)
        better = point is not None and _merit(point) < _merit(now) - _MARGIN * abs(_merit(now))
        found.steps.append(_told(number, problem, point, better, radius, told))
        if not better or point is None:
            bent = _bent(now, point, jacobian @ step) if bent is None and point is not None else None
            if bent is not None:
                continue  # once more, where constraints that bend are foreseen to
            radius *= _SHRINK
            if radius < _LEAST:
                return "converged"
            continue
        if problem.region.outside(_values(problem, point)) > max(
            1.0, problem.region.outside(problem.parameters.values)
        ):
            found.reason = "the next step would leave what the model was trained on"
            return "left_trained_region"
        now, bent = point, None
        found.points.append(now)
        radius = min(_WIDEST, _GROW * radius)
        if len(found.points) > _PATIENCE:
            gained = _merit(found.points[-1 - _PATIENCE]) - _merit(now)
            if gained < _GAIN * max(abs(_merit(now)), 1e-3):
                return "converged"
        slope, jacobian = problem.slopes(now)
    return "budget_reached"


def _bent(now: Point, point: Point, foreseen: np.ndarray) -> np.ndarray | None:
    """What constraints are broken by beyond what their slopes foresaw, where the step was refused for that;
    else None.

    The step is then tried again with that added (a second-order correction: Nocedal and Wright, 2006, 18.3).
    """
    more = np.maximum(point.broken - now.broken - foreseen, 0.0)
    straight = point.value + PENALTY * float(np.maximum(point.broken - more, 0).sum())
    return more if straight < _merit(now) and more.any() else None


def _values(problem: Problem, point: Point) -> np.ndarray:
    return problem.parameters.values + point.change * problem.parameters.units


def _merit(point: Point) -> float:
    """The weighted sum, and what is broken at a price above any multiplier."""
    return point.value + PENALTY * float(np.maximum(point.broken, 0).sum())


def _told(
    number: int,
    problem: Problem,
    point: Point | None,
    accepted: bool,
    radius: float,
    told: Callable[[Step], None] | None,
) -> Step:
    value, broken = (point.value, float(point.broken.max(initial=0.0))) if point else (np.nan, np.nan)
    numbers = point.numbers if point else {}
    step = Step(
        number,
        problem.options.steps,
        accepted,
        value,
        broken,
        radius,
        numbers,
        point.assembly if point else None,
    )
    if told is not None:
        told(step)
    return step
