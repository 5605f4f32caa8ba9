"""A fit's progress: a bar on a terminal, plain lines elsewhere; both on stderr."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from partwright.cli.terminal import counted, note, printable
from partwright.durations import duration

_QUIET = 1.0  # seconds between plain lines of one stage
_PATIENT = 10.0  # the same, where they tell nothing but the time
# Where on the bar each begins: reading takes what is before the fit, writing what is left.
_FIT, _SCORES, _WRITING = 0.1, 0.75, 0.85


def _bar(detail: str) -> Progress | None:
    """A bar with a time left, or None where there is no terminal."""
    console = Console(file=sys.stderr)
    if not console.is_terminal:
        return None
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn(detail, markup=False),
        TimeRemainingColumn(compact=True),
    )
    return Progress(*columns, console=console, transient=True)


class _Shown:
    """A context with a bar of one task; `detail` stands beside it, `total` is None while not known."""

    def __init__(self, name: str, detail: str, total: float | None = 1.0) -> None:
        self._name = name
        self._bar = _bar(detail)
        self._total = total
        self._last_time = 0.0

    def __enter__(self) -> Self:
        if self._bar:
            self._bar.start()
            self._task = self._bar.add_task(self._name, total=self._total, detail="")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()


class Display(_Shown):
    """A context in which `show` takes the method's progress and `stage` names what else goes on."""

    def __init__(self) -> None:
        super().__init__("reading", "{task.fields[detail]}")
        self._last_stage = ""

    def __enter__(self) -> Self:
        if not self._bar:
            note(self._name)
        return super().__enter__()

    def show(self, step: Any) -> None:
        """One report of the method: .stage .round .rounds .parts .iou .fraction."""
        detail = f"round {step.round}/{step.rounds}  {counted(step.parts, 'part')}  IoU {step.iou:.3f}"
        if self._bar:
            stage = printable(step.stage) if step.fraction < 1 else "scores"
            done = _FIT + step.fraction * (_SCORES - _FIT)
            self._bar.update(self._task, description=stage, completed=done, detail=detail)
        elif step.stage != self._last_stage or time.monotonic() - self._last_time > _QUIET:
            note(f"{step.stage}: {detail}  {step.fraction:.0%}")
            self._last_stage, self._last_time = step.stage, time.monotonic()

    def stage(self, name: str, done: float = _WRITING) -> None:
        """A stage without rounds, as a rule after the method's own; done: share of the work before it."""
        if self._bar:
            self._bar.update(self._task, description=name, completed=done, detail="")
        else:
            note(name)

    def wait(self, name: str, seconds: float) -> None:
        """A stage of which nothing is known but how long it has been at work."""
        if self._bar:
            self._bar.update(self._task, description=name, detail=f"{seconds:.0f} s")
        elif seconds > _PATIENT and time.monotonic() - self._last_time > _PATIENT:
            note(f"{name}: {seconds:.0f} s")
            self._last_time = time.monotonic()


class Count(_Shown):
    """A context in which `show` counts things that get done one by one."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "{task.completed:.0f}/{task.total:.0f}  {task.fields[detail]}", None)
        self._begun = (time.monotonic(), 0, 0)  # when how many of how many were done

    def show(self, done: int, total: int, what: str) -> None:
        """`what` was just done, the `done`th of `total`."""
        now = time.monotonic()
        if self._bar:
            self._bar.update(self._task, completed=done, total=total, detail=printable(what))
            return
        since, before, of = self._begun
        if total != of or done < before:  # something else is counted now
            self._begun = since, before, of = now, done, total
        if done == total or now - self._last_time > _QUIET:
            left = (now - since) / (done - before) * (total - done) if done > before else 0.0
            note(f"{self._name}: {done}/{total}  {what}" + (f"  {duration(left)} left" if left else ""))
            self._last_time = now


class Work(_Shown):
    """A context in which `stage` names what goes on, and `show` says how much of it is done."""

    def __init__(self, name: str) -> None:
        super().__init__(name, "{task.percentage:.0f}%")

    def stage(self, name: str) -> None:
        """What begins now."""
        self._name = name
        if self._bar:
            self._bar.reset(self._task, description=name, total=1.0)
        else:
            self._line(name)

    def show(self, share: float) -> None:
        """How much of the stage is done, from 0 to 1."""
        if self._bar:
            self._bar.update(self._task, completed=share)
        elif time.monotonic() - self._last_time > _QUIET:
            self._line(f"{self._name}: {share:.0%}")

    def _line(self, text: str) -> None:
        note(text)
        self._last_time = time.monotonic()
