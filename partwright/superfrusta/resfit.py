"""Residual Primitive Fitting (SuperFrusta, section 3.1): grow into the residual, optimise, prune, repeat.

After growing, the assembly is thinned out with refits and grown again: at the same number of parts that
explains more than stopping early.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from partwright.assembly import Assembly
from partwright.assembly.rows import parts_from_rows
from partwright.errors import EmptyShapeError
from partwright.shapes import Shape
from partwright.superfrusta.evidence import Evidence, Rows
from partwright.superfrusta.growing import grow
from partwright.superfrusta.merging import merge
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.pruning import cheapest_removal, prune
from partwright.superfrusta.refining import COARSE_TO_FINE, FINE, POLISH, refine
from partwright.superfrusta.settings import Settings

Outcome = Literal["converged", "budget_reached", "target_reached", "interrupted"]

# In growth, parts need only pay this; the settings' alpha decides when the assembly is thinned out.
_GROWTH_ALPHA = 1e-3
_PROGRESS = 1e-3  # rise of the objective below which a round counts as stale


@dataclass(frozen=True)
class Progress:
    """Where a fit is: `fraction` of the expected work, and the best assembly so far in numbers."""

    stage: str
    round: int
    rounds: int
    parts: int
    iou: float
    fraction: float


@dataclass
class Fitted:
    """A fit's result: the assembly in the shape's own units and place, and how it came about."""

    assembly: Assembly
    outcome: Outcome
    seconds: dict[str, float]
    history: list[dict[str, float]]


def fit(
    shape: Shape, settings: Settings | None = None, progress: Callable[[Progress], None] | None = None
) -> Fitted:
    """Fits an assembly of SuperFrusta to a shape.

    Ctrl-C ends the fit with the best assembly so far and the outcome "interrupted".

    Raises:
        EmptyShapeError: nothing could be fitted (the shape is thinner than the samples can see).
    """
    settings = settings or Settings()
    run = Run(settings, progress)
    try:
        with run.timed("prepare"):
            evidence = Evidence.of(shape, settings)
        outcome = run.through(evidence)
    except KeyboardInterrupt:
        if run.best is None:
            raise
        outcome = "interrupted"
    if run.best is None:
        raise EmptyShapeError(
            f"{shape.name}: no part could be placed; the shape has no volume that {settings.near} samples "
            "can see. Check its thickness, or use --quality high"
        )
    parts = parts_from_rows(run.best)
    unit = Assembly(parts, unit=shape.unit)
    frame = shape.frame
    assembly = unit.scaled(1 / frame.scale).translated(frame.centre)
    return Fitted(assembly, outcome, run.seconds, run.history)


@dataclass
class Run:
    """State of one fit."""

    settings: Settings
    report: Callable[[Progress], None] | None
    best: Rows | None = None
    best_objective: float = -np.inf
    seconds: dict[str, float] = field(default_factory=dict)
    history: list[dict[str, float]] = field(default_factory=list)

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start

    def through(self, evidence: Evidence) -> Outcome:
        rows, converged = self.growth(evidence)
        if self.best is None:
            return "converged"
        for cycle in range(self.settings.cycles):
            rows = self.thinning(evidence, rows, cycle)
            if not self.keep(evidence, rows, "thin", cycle + 1) and cycle:
                break
            if cycle + 1 < self.settings.cycles:
                rows = self.regrowth(evidence, rows)
        if self.settings.max_parts is not None and len(self.best) >= self.settings.max_parts:
            return "budget_reached"
        if self.settings.min_iou is not None and volume_iou(evidence, self.best) >= self.settings.min_iou:
            return "target_reached"
        return "converged" if converged else "budget_reached"

    def growth(self, evidence: Evidence) -> tuple[Rows, bool]:
        """Rounds of growing until the objective saturates; returns the last rows and whether it did."""
        settings = self.settings
        rows = np.empty((0, 16), np.float32)
        stale = 0
        for round_ in range(settings.rounds):
            with self.timed("grow"):
                new = grow(evidence, rows, settings, settings.regions)
            if len(new) == 0:
                return rows, True
            with self.timed("optimise"):
                rows = refine(
                    evidence, np.concatenate([rows, new]), COARSE_TO_FINE if round_ == 0 else FINE, settings
                )
            with self.timed("prune"):
                rows = prune(evidence, rows, _GROWTH_ALPHA)
            stale = 0 if self.keep(evidence, rows, "grow", round_ + 1) else stale + 1
            if stale >= settings.patience:
                return rows, True
        return rows, False

    def thinning(self, evidence: Evidence, rows: Rows, cycle: int) -> Rows:
        """Removes parts with refits while the objective, the part budget or the target asks for it."""
        settings = self.settings
        most = settings.max_parts if settings.max_parts is not None else len(rows)
        with self.timed("merge"):
            rows = merge(evidence, rows, settings)
        with self.timed("thin"):
            while len(rows) > 1:
                thinned, kept, whole = cheapest_removal(evidence, rows, settings)
                if len(rows) <= most and not self.worthwhile(evidence, thinned, kept, whole):
                    break
                rows = thinned
        with self.timed("optimise"):
            return refine(evidence, rows, POLISH, settings)

    def worthwhile(self, evidence: Evidence, thinned: Rows, kept: float, whole: float) -> bool:
        if self.settings.min_iou is not None:
            return volume_iou(evidence, thinned) >= self.settings.min_iou
        return kept + self.settings.alpha >= whole

    def regrowth(self, evidence: Evidence, rows: Rows) -> Rows:
        with self.timed("grow"):
            new = grow(evidence, rows, self.settings, self.settings.regions)
        if len(new) == 0:
            return rows
        with self.timed("optimise"):
            return refine(evidence, np.concatenate([rows, new]), FINE, self.settings)

    def keep(self, evidence: Evidence, rows: Rows, stage: str, round_: int) -> bool:
        """Records the state and keeps it if it is the best so far; says whether it made progress."""
        settings = self.settings
        reached = score(evidence, rows)
        objective = reached - settings.alpha * len(rows)
        over = settings.max_parts is not None and len(rows) > settings.max_parts
        progressed = objective > self.best_objective + _PROGRESS
        if objective > self.best_objective or self.best is None or stage == "thin":
            self.best, self.best_objective = rows, objective
        iou = volume_iou(evidence, rows)
        self.history.append(
            {
                "stage": float(stage == "thin"),
                "round": round_,
                "parts": len(rows),
                "score": reached,
                "iou": iou,
            }
        )
        if self.report is not None:
            total = settings.rounds + settings.cycles
            done = round_ if stage == "grow" else settings.rounds + round_
            self.report(Progress(stage, round_, settings.rounds, len(rows), iou, min(1.0, done / total)))
        return progressed and not over
