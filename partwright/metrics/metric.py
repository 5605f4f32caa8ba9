"""What a metric is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from partwright.metrics.comparison import Comparison


@dataclass(frozen=True)
class Metric:
    """A number that says how good an assembly is. `table` lists them by name."""

    measure: Callable[[Comparison], float]
    """The number; what it needs it asks of the comparison."""

    better: Literal["higher", "lower"]
    """Which of two numbers is the better one."""

    def __call__(self, comparison: Comparison) -> float:
        return self.measure(comparison)
