"""Linear equations on a vector, added one by one, and the nearest vector that meets them all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_DEPENDENT = 1e-7  # relative length of what is left of an equation by the earlier ones


@dataclass(frozen=True)
class Equations:
    """A vector and the linear equations that it meets.

    It is the nearest to where it started: adding the part of each equation that is orthogonal to the earlier
    ones is the projection onto all of them.
    """

    vector: Floats
    """(n,) numbers that meet all equations."""
    weight: Floats
    """(n,) by which the entries' distances count."""
    basis: Floats
    """(m, n) orthonormal rows that span the equations, entries over their weight."""

    @classmethod
    def of(cls, vector: Floats, weight: Floats) -> Equations:
        return cls(vector, weight, np.empty((0, len(vector))))

    def with_row(self, row: Floats, value: float, same: float) -> Equations | None:
        """With row @ vector = value as well; None where that contradicts what holds by more than `same`."""
        scaled = row / self.weight
        missing = value - float(row @ self.vector)
        left = scaled - self.basis.T @ (self.basis @ scaled)
        left -= self.basis.T @ (self.basis @ left)
        size = float(np.linalg.norm(left))
        if size <= _DEPENDENT * float(np.linalg.norm(scaled)):
            return self if abs(missing) <= same else None
        unit = left / size
        vector = self.vector + unit * (missing / size) / self.weight
        return replace(self, vector=vector, basis=np.vstack([self.basis, unit]))

    def determined(self, row: Floats) -> bool:
        """Whether the equations leave row @ vector no choice."""
        scaled = row / self.weight
        left = scaled - self.basis.T @ (self.basis @ scaled)
        return float(np.linalg.norm(left)) <= _DEPENDENT * float(np.linalg.norm(scaled))

    def freedom(self, locked: NDArray[np.bool_]) -> Floats:
        """(n, d): steps of the vector that keep all equations and the entries `locked` (n,), as columns."""
        fixed = np.eye(len(self.vector))[locked]
        rows = np.vstack([self.basis, fixed])
        _, sizes, directions = np.linalg.svd(rows, full_matrices=True)
        rank = int((sizes > 1e-8).sum())
        return directions[rank:].T / self.weight[:, None]
