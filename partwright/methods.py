"""What every method of fitting has: presets of checked settings, progress, an outcome, timed stages."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, TypeVar

from partwright.errors import SettingError

Outcome = Literal["converged", "budget_reached", "target_reached", "interrupted"]
Quality = Literal["draft", "normal", "high"]
Settings = TypeVar("Settings")


@dataclass(frozen=True)
class Progress:
    """Where a fit is: `fraction` of the expected work, and the best result so far in numbers."""

    stage: str
    round: int
    rounds: int
    parts: int
    iou: float
    fraction: float


def preset(presets: Mapping[str, Settings], quality: str, changes: Mapping[str, Any]) -> Settings:
    """The settings of a quality, with `changes` on top.

    Raises:
        SettingError: the preset or a change is unknown or out of range.
    """
    if quality not in presets:
        raise SettingError(f"quality: expected one of {', '.join(presets)}, got {quality!r}")
    chosen: Any = presets[quality]
    unknown = set(changes) - {field.name for field in fields(chosen)}
    if unknown:
        raise SettingError(f"unknown settings: {', '.join(sorted(unknown))}")
    changed: Settings = replace(chosen, **changes)
    return changed


def check_number(name: str, value: float, low: float, high: float = math.inf) -> None:
    """Raises SettingError unless the value is a finite number from `low` to `high`."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if not number or not low <= value <= high:
        upper = f" and at most {high:g}" if math.isfinite(high) else ""
        raise SettingError(f"{name}: expected a number of at least {low:g}{upper}, got {value!r}")


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Adds the time that the context takes to that of the stage."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start
