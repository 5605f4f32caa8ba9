"""What a growth has reached with how many parts: attempts of one shape are compared at the same number."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

_TELLING = 6  # parts: with fewer, an attempt that subtracts has hardly begun


@dataclass
class Frontier:
    """The objective by the number of parts, over the rounds of one or more attempts."""

    rounds: list[tuple[int, float]] = field(default_factory=list)

    def add(self, parts: int, objective: float) -> None:
        self.rounds.append((parts, objective))

    def at(self, parts: int) -> float:
        """The best objective with at most so many parts; between two rounds as if it rose evenly, and before
        the first as at it, for rounds begin with several parts at once."""
        if not self.rounds:
            return -np.inf
        counts, best = np.array(sorted(self.rounds)).T
        return float(np.interp(parts, counts, np.maximum.accumulate(best)))

    def lead(self, parts: int, objective: float) -> float:
        """How far an objective with so many parts is ahead; 0 where it is behind, but too early to tell."""
        if not self.rounds:
            return 0.0
        ahead = objective - self.at(parts)
        return ahead if parts >= _TELLING else max(ahead, 0.0)
