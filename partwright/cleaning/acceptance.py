"""Which changes are cheap enough: no part may end up further from the target than the tolerance allows.

Of a thin part, less is allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.rows import as_superfrustum
from partwright.cleaning.deviation_samples import State
from partwright.cleaning.linear import Equations
from partwright.cleaning.model import Model
from partwright.cleaning.refitting import refit
from partwright.errors import CancelledError, ParameterError
from partwright.methods import Cancellation

Floats = NDArray[np.float64]

_THIN = 60.0
_LOCAL = 6  # iterations of a refit of one part


@dataclass(frozen=True)
class AcceptanceTest:
    """What a change may cost. Of a part's thickness, a sixtieth at most may be lost: 3 % of its volume."""

    limit: Floats
    """(L,) mean deviation that each part's own surface may have, unit lengths."""
    tolerance: float
    """How much of that the cleaning may add, unit lengths."""
    cancel: Cancellation = field(default_factory=Cancellation)
    """Asked before each change."""

    @classmethod
    def of(cls, state: State, tolerance: float, cancel: Cancellation) -> AcceptanceTest:
        fields = (as_superfrustum(part.field) for part in state.model.leaves)
        thickness = np.array([field.thinnest for field in fields]) * state.samples.scale
        return cls(state.deviations + np.minimum(tolerance, thickness / _THIN), tolerance, cancel)

    def without_limit(self) -> AcceptanceTest:
        """One that accepts whatever the fields allow."""
        return replace(self, limit=np.full(len(self.limit), np.inf))

    def _check_cancelled(self) -> None:
        if self.cancel.requested:
            raise CancelledError("cancelled before the assembly was clean; it stays as it was")

    def accepts(self, state: State) -> bool:
        return bool((state.deviations <= self.limit + 1e-9).all())

    def leaf(self, state: State, leaf: int, model: Model, locked: Sequence[str] = ()) -> State | None:
        """The state with one leaf otherwise, its own numbers but those `locked` (variable kinds or names of
        dimensions) fitted anew; None where that costs too much."""
        self._check_cancelled()
        try:
            trial = state.changed(model, model.vector, [leaf])
        except ParameterError:
            return None
        free = [
            at
            for at, v in enumerate(model.variables)
            if v.leaf == leaf and v.kind not in locked and not (v.dimension and v.dimension.name in locked)
        ]
        refitted = refit(trial, _together(model, leaf, free), _LOCAL)
        best = min((trial, refitted), key=lambda s: float((s.deviations - self.limit).max()))
        return best.settled() if self.accepts(best) else None

    def equations(self, state: State, equations: Equations) -> State | None:
        """The state with the vector that meets the equations; None where that costs too much."""
        moved = np.abs(equations.vector - state.vector) > 0
        leaves = sorted({v.leaf for v, one in zip(state.model.variables, moved, strict=True) if one})
        if not leaves:
            return state
        self._check_cancelled()
        try:
            trial = state.changed(state.model, equations.vector, leaves)
        except ParameterError:
            return None
        return trial if self.accepts(trial) else None


def _together(model: Model, leaf: int, free: list[int]) -> Floats:
    """(n, d) directions: places of a leaf's copies move as its instances take them along."""
    first = int(model.firsts[leaf])
    base = model.places(first)
    columns = []
    for at in free:
        variable = model.variables[at]
        if variable.kind == "place" and variable.copy != first:
            continue
        direction = np.zeros(len(model.variables))
        direction[at] = 1.0
        if variable.kind == "place":
            for c in np.flatnonzero(model.leaf_of == leaf)[1:]:
                turn = model.rotations[c] @ model.rotations[first].T
                direction[model.places(int(c))] = turn[:, base.index(at)]
        columns.append(direction)
    return np.array(columns).reshape(-1, len(model.variables)).T
