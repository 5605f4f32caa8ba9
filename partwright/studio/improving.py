"""Goals behind the page: parts changed for one, as work for a thread of its own.

PyTorch is imported where it is wanted.
"""

from __future__ import annotations

from collections.abc import Callable
from glob import escape
from importlib.util import find_spec
from typing import TYPE_CHECKING

from partwright.assembly import Assembly
from partwright.errors import SettingError
from partwright.methods import Cancellation, Progress
from partwright.studio import messages
from partwright.studio.fits import Done, Task

if TYPE_CHECKING:
    from partwright.goals import Step

_NAMES = ("volume", "inertia", "frontal_area", "newtonian_drag", "centre")
"""Objectives that read no files: a page must not name any, nor code of the server's machine."""
_MOST_STEPS = 500


def goals() -> list[str]:
    """What pages may ask for; nothing where PyTorch is not installed."""
    return list(_NAMES) if find_spec("torch") is not None else []


def improving(assembly: Assembly, message: messages.Improve) -> Task:
    """The parts that are not locked changed so that the goal's number gets less.

    Raises:
        SettingError: there is no such goal, or the number of steps or a share makes no sense.
    """
    if message.goal not in goals():
        raise SettingError(f"goal: expected one of {', '.join(goals()) or 'none (PyTorch is not installed)'}")
    if not 1 <= message.steps <= _MOST_STEPS:
        raise SettingError(f"steps: expected a number from 1 to {_MOST_STEPS}, got {message.steps}")
    shares = {"wall_thickness": message.walls, "volume": message.volume}
    for name, share in shares.items():
        if not 0 <= share <= 100:
            raise SettingError(f"{name}: expected a share from 0 to 100 %, got {share:g}")
    bounds = [f"{name}>={share:g}%" for name, share in shares.items() if share > 0]
    axis = "" if message.goal == "volume" else f"@{message.axis}"

    def work(progress: Callable[[Progress | messages.Improving], None], cancel: Cancellation) -> Done:
        from partwright.goals import Options, optimise

        goal = message.goal + axis
        curve: list[messages.Tried] = []

        def told(step: Step) -> None:
            value = step.numbers.get(goal)
            if value is None:
                return
            curve.append(messages.Tried(step.number, float(value), step.accepted))
            progress(messages.Improving(goal, step.of, list(curve)))
            now = step.assembly if step.accepted else None
            best = None if now is None else lambda: now
            progress(Progress("goal", step.number, step.of, len(assembly), 0.0, step.number / step.of, best))

        result = optimise(
            assembly,
            goal,
            bounds=bounds,
            freeze=[escape(name).replace(":", "?") for name in message.locked],
            options=Options(steps=message.steps),
            progress=told,
            cancel=cancel,
        )
        return Done(result.assembly, messages.Fitted(result.ending, len(result.assembly), 0.0))

    return Task(f"Less {message.goal.replace('_', ' ')}", work)
