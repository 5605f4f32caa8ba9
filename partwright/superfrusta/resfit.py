"""Residual Primitive Fitting (SuperFrusta, section 3.1): grow into the residual, optimise, prune, repeat.

After growing, the assembly is thinned out with refits and grown again: at the same number of parts that
explains more than stopping early.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from partwright.assembly import Assembly
from partwright.methods import Checkpoint, Outcome, Progress, timed
from partwright.shapes import Shape
from partwright.superfrusta.carving import Carving
from partwright.superfrusta.frontier import Frontier
from partwright.superfrusta.growing import grow
from partwright.superfrusta.last_changes import last_changes
from partwright.superfrusta.last_polish import last_polished
from partwright.superfrusta.mending import Mending
from partwright.superfrusta.merging import cheapest_merger, merge
from partwright.superfrusta.objective import coverage, score, volume_iou
from partwright.superfrusta.outcome import Step, chosen
from partwright.superfrusta.pruning import cheapest_removal, drop_least, prune
from partwright.superfrusta.refining import COARSE_TO_FINE, FINE, POLISH, optimise
from partwright.superfrusta.repeated_parts import repeat, symmetry_tolerance
from partwright.superfrusta.samples import NOTHING, FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.simplification import extend_cuts, simplify_kinds
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded
from partwright.superfrusta.symmetry import NEARLY, symmetries

# In growth, parts need only pay this; the settings' alpha decides when the assembly is thinned out.
GROWTH_ALPHA = 1e-3
PROGRESS = 1e-3  # rise of the objective below which a round counts as stale
_TRAILING = 0.05  # of the objective, at the same number of parts: what is so far behind is given up
_THINNED = 0.06  # of the objective: hardly any assembly gains more by being thinned
_PACE = 3  # rounds that say how fast growth is
MENDED = 0.9  # of the work is done when mending begins
_SPARE = 0.01  # IoU that growth goes beyond a target, for thinning to spend


@dataclass
class ResidualFit:
    """State of one fit: the samples that all its scores are of, and the best rows so far, of which the first
    `locked` never change.

    report: told of each step. assembled: makes the assembly of rows. rival: the objective that an attempt to
    carve must reach to be kept. reached: what this attempt has by growth; reached_before: what those before
    it had. furthest: that progress was told. attempts: what each came to. unmended: the best before it was
    mended.
    """

    samples: FitSamples
    settings: Settings
    report: Callable[[Progress], None] | None = None
    locked: int = 0
    assembled: Callable[[Rows], Assembly] | None = None
    checkpoint: Checkpoint | None = None
    best: Rows | None = None
    best_objective: float = -np.inf
    rival: float | None = None
    reached: Frontier = field(default_factory=Frontier)
    reached_before: Frontier = field(default_factory=Frontier)
    furthest: float = 0.0
    earlier: Rows | None = None
    attempts: list[Rows] = field(default_factory=list)
    unmended: Rows | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    history: list[dict[str, float | str]] = field(default_factory=list)
    curve: list[Step] = field(default_factory=list)
    leaves: list[RepeatedPart] = field(default_factory=list)

    def another(self, settings: Settings, locked: int | None = None) -> ResidualFit:
        """A search of its own, by the same samples, for a part of this one's work."""
        locked = self.locked if locked is None else locked
        return ResidualFit(self.samples, settings, locked=locked, seconds=self.seconds)

    def timed(self, stage: str) -> AbstractContextManager[None]:
        return timed(self.seconds, stage)

    def run(self, start: Rows = NOTHING) -> Outcome:
        """One growth and all that follows it; several are several_growths.py's."""
        return self.finished(self.grown(start))

    def grown(self, start: Rows = NOTHING) -> bool:
        """One growth, by parts to add and then to subtract, and mended; says whether what is kept of it
        converged."""
        carving = Carving(self)
        converged = carving.contest() if carving.allowed and not len(start) else self.attempt(start)
        if self.best is not None:
            found = carving.recombined(self.best) if self.mending else self.best
            if found is not self.best:
                self.best = found
                self.report_progress("recombine", self.settings.rounds, found, MENDED)
            self.unmended = self.best
            if self.mending:
                self.mend(self.best)
        return converged

    def finished(self, converged: bool) -> Outcome:
        """What the settings ask for of the best so far."""
        settings = self.settings
        if self.best is None:
            return "converged"
        if settings.family == "solid":
            with self.timed("settle"):
                plain = simplify_kinds(self.samples, self.best, settings, self.locked)
                self.best = extend_cuts(self.samples, plain, self.locked)
        if settings.curve:
            self.detail_curve(self.best)
            self.best = chosen(self.curve, settings).rows
            self.best_objective = self.objective(self.best)
        if settings.min_iou is not None and volume_iou(self.samples, self.best) >= settings.min_iou:
            return "target_reached"
        if settings.max_parts is not None and len(self.best) >= settings.max_parts:
            return "budget_reached"
        return "converged" if converged else "budget_reached"

    def attempt(self, start: Rows, first: int = 0) -> bool:
        """Grown from the start, from round `first` on, and thinned out, beside an earlier attempt; says
        whether growth converged."""
        if self.best is not None:
            self.attempts.append(self.best)
            self.earlier = self.best
            self.best, self.best_objective = None, -np.inf
            self.reached_before.rounds += self.reached.rounds
            self.reached = Frontier()
        if self.settings.subtract and not len(start) and self.rival is None:
            start = Carving(self).started()
        rows, converged = self.growth(start, range(first, self.settings.rounds))
        if not self.trailing and not self.out_of_reach(self.best_objective):
            self.thin(rows)
        if self.best is not None:
            self.attempts.append(self.best)
        return converged

    def thin(self, rows: Rows) -> None:
        """Thinned out as often as the settings say, and grown again in between."""
        for cycle in range(self.settings.cycles if self.best is not None else 0):
            rows = self.thinning(rows)
            if not self.keep(rows, "thin", cycle + 1) and cycle:
                break
            if cycle + 1 < self.settings.cycles:
                rows = self.regrowth(rows)

    def choose(self) -> None:
        """Goes back to the earlier attempts' best where this one's is no better."""
        if self.earlier is None:
            return
        latest, self.best, self.earlier = self.best, self.earlier, None
        self.best_objective = self.objective(self.best)
        if latest is not None and self.better(latest):
            self.best, self.best_objective = latest, self.objective(latest)

    def growth(self, rows: Rows, rounds: range | None = None) -> tuple[Rows, bool]:
        """Rounds of growing until the objective saturates, all or these; returns the last rows and whether it
        did."""
        settings = self.settings
        rounds = range(settings.rounds) if rounds is None else rounds
        if len(rows) and self.best is None:
            with self.timed("optimise"):
                rows = optimise(self.samples, rows, FINE, settings, self.locked)
            self.keep(rows, "start", 0)
        stale, reached = 0, [self.best_objective]
        for round_ in rounds:
            with self.timed("grow"):
                most = settings.at_once(round_, settings.regions)
                new = grow(self.samples, rows, settings, most)
            if len(new) == 0:
                return rows, True
            with self.timed("optimise"):
                stages = FINE if len(rows) else COARSE_TO_FINE
                rows = optimise(self.samples, new.joined(rows, self.locked), stages, settings, self.locked)
            with self.timed("prune"):
                rows = prune(self.samples, rows, min(GROWTH_ALPHA, settings.price), self.locked)
            stale = 0 if self.keep(rows, "grow", round_ + 1) else stale + 1
            reached.append(self.best_objective)
            hopeless = self.trailing or self.too_slow(reached, rounds.stop - round_ - 1)
            if stale >= settings.patience or hopeless:
                return rows, True
            if settings.min_iou is not None and volume_iou(self.samples, rows) > settings.min_iou + _SPARE:
                return rows, True
        return rows, False

    @property
    def trailing(self) -> bool:
        """Whether this attempt is so far behind those before it that more rounds are no help."""
        if self.best is None:
            return False
        return self.is_behind(self.reached_before.lead(len(self.best), self.best_objective))

    def out_of_reach(self, objective: float) -> bool:
        """Whether what has grown to an objective will not have its rival's, if there is one, thinned out."""
        return self.rival is not None and objective + _THINNED < self.rival

    def too_slow(self, reached: Sequence[float], rounds: int) -> bool:
        """Whether an attempt to carve, with as many parts no better than those before it, has its rival out
        of reach at the pace of its last rounds. reached: the best after each; rounds: those to come.

        One that is better with as many parts may yet find what it is about: a cut that empties a ring.
        """
        if self.best is None or len(reached) <= _PACE:
            return False
        pace = (reached[-1] - reached[-1 - _PACE]) / _PACE
        behind = self.reached_before.lead(len(self.best), self.best_objective) < 0
        return behind and self.out_of_reach(reached[-1] + rounds * pace)

    @staticmethod
    def is_behind(lead: float) -> bool:
        return lead < -_TRAILING

    def thinning(self, rows: Rows) -> Rows:
        """Merges and removes parts while the objective, the part budget or the target asks for it."""
        settings = self.settings
        most = settings.max_parts if settings.max_parts is not None else len(rows)
        if settings.merging:
            with self.timed("merge"):
                rows = merge(self.samples, rows, settings, self.locked)
        with self.timed("thin"):
            while len(rows) > max(1, self.locked):
                if len(rows) > most:
                    rows = self.remove_or_merge(rows)
                    continue
                thinned, kept, whole = cheapest_removal(self.samples, rows, settings, self.locked)
                if not self.worthwhile(thinned, kept, whole):
                    break
                rows = thinned
        with self.timed("optimise"):
            rows = optimise(self.samples, rows, POLISH, settings, self.locked)
            if self.sampled_strays(rows):
                rows = optimise(self.samples, rows, POLISH, settings, self.locked)
            if settings.family == "solid":
                rows = simplify_kinds(self.samples, rows, settings, self.locked)
        return rows

    def worthwhile(self, thinned: Rows, kept: float, whole: float) -> bool:
        if self.settings.min_iou is not None:
            return volume_iou(self.samples, thinned) >= self.settings.min_iou
        return kept + self.settings.alpha >= whole

    def regrowth(self, rows: Rows) -> Rows:
        with self.timed("grow"):
            new = grow(self.samples, rows, self.settings, self.settings.regions)
        if len(new) == 0:
            return rows
        with self.timed("optimise"):
            return optimise(self.samples, new.joined(rows, self.locked), FINE, self.settings, self.locked)

    def remove_or_merge(self, rows: Rows) -> Rows:
        """The cheapest way to do with one part less: a removal or a merger."""
        thinned, kept, _ = cheapest_removal(self.samples, rows, self.settings, self.locked, coverage)
        merged = (
            cheapest_merger(self.samples, rows, self.settings, self.locked) if self.settings.merging else None
        )
        return merged[0] if merged is not None and merged[1] > kept else thinned

    @property
    def mending(self) -> bool:
        settings = self.settings
        return bool(settings.mends) and settings.family != "solid"

    def mend(self, rows: Rows) -> None:
        def improved(better: Rows) -> None:
            self.best = better
            self.report_progress("mend", self.settings.rounds, better, MENDED)

        with self.timed("mend"):
            self.best = Mending(self.samples, self.settings, self.locked, improved)(rows)
            self.best_objective = self.objective(self.best)

    def detail_curve(self, rows: Rows) -> None:
        """The curve: one part less at a time, each size polished; from few parts to many."""
        with self.timed("curve"):
            steps = [Step(rows, score(self.samples, rows), volume_iou(self.samples, rows))]
            while len(rows) > max(1, self.locked):
                rows = self.remove_or_merge(rows)
                rows = optimise(self.samples, rows, FINE, self.settings, self.locked)
                steps.append(Step(rows, score(self.samples, rows), volume_iou(self.samples, rows)))
        self.curve = steps[::-1]

    def find_repeats(self, shape: Shape) -> None:
        self.enforce_budget()
        assert self.best is not None
        with self.timed("symmetry"):
            tolerance = symmetry_tolerance(self.samples, self.best)
            nearly = self.samples.find_symmetries()
            if tolerance > NEARLY:  # what holds less well was not looked for
                nearly = symmetries(shape, self.settings, tolerance=tolerance)
            found = [one for one in nearly if one.error <= tolerance]
            self.leaves = repeat(self.samples, self.best, found, self.settings, self.locked, nearly)
            rows = expanded(self.leaves)
        self.report_progress("symmetry", self.settings.rounds, rows, 1.0, len(self.leaves))

    def polish(self, shape: Shape, known: int) -> None:
        """The leaves, but for those that are locked and the last, of which so many are `known`."""
        index = np.arange(len(self.leaves))
        moving = (index >= self.locked) & (index < len(self.leaves) - known)
        with self.timed("polish"):
            self.leaves = last_polished(shape, self.samples, self.leaves, self.settings, moving)
        with self.timed("change"):
            for better in last_changes(shape, self.samples, self.leaves, self.settings, moving):
                self.leaves = better

    def enforce_budget(self) -> None:
        """What an interruption or a fit without thinning left over the part budget goes, without refits."""
        most = self.settings.max_parts
        if self.best is None or most is None:
            return
        while len(self.best) > max(most, self.locked, 1):
            self.best = drop_least(self.samples, self.best, self.locked)

    def keep(self, rows: Rows, stage: str, round_: int) -> bool:
        """Records the state and keeps it if it is the best so far; says whether it made progress."""
        settings = self.settings
        self.sampled_strays(rows)
        objective = self.objective(rows)
        progressed = objective > self.best_objective + PROGRESS
        if self.better(rows):
            self.best, self.best_objective = rows, objective
        if stage == "grow":
            self.reached.add(len(rows), objective)
        total = settings.rounds + settings.cycles
        done = min(1.0, (settings.rounds + round_ if stage == "thin" else round_) / total)
        carved = self.rival is not None
        attempts = 1 + (Carving(self).allowed or carved)
        fraction = (carved + done) / attempts * (MENDED if self.mending else 1.0)
        self.report_progress(stage, round_, rows, fraction)
        return progressed

    def sampled_strays(self, rows: Rows) -> bool:
        """Whether these rows go astray where no samples were; now some are, and the best is scored anew."""
        samples = self.samples.with_stray_samples(rows)
        if samples is self.samples:
            return False
        self.take_samples(samples)
        return True

    def take_samples(self, samples: FitSamples) -> None:
        """Goes on with other samples, by which the best is scored anew."""
        self.samples = samples
        if self.best is not None:
            self.best_objective = self.objective(self.best)

    def objective(self, rows: Rows, parts: int | None = None) -> float:
        """parts: to be paid for, if not all rows are."""
        count = len(rows) if parts is None else parts
        return score(self.samples, rows) - self.settings.price * count

    def better(self, rows: Rows) -> bool:
        """Whether these rows take the place of the best so far."""
        if self.best is None or self.objective(rows) > self.best_objective:
            return True
        return self.due(rows, volume_iou(self.samples, rows))

    def report_progress(
        self, stage: str, round_: int, rows: Rows, fraction: float, parts: int | None = None
    ) -> None:
        """parts: if not all rows are."""
        parts = len(rows) if parts is None else parts
        reached, iou = score(self.samples, rows), volume_iou(self.samples, rows)
        entry: dict[str, float | str] = {"stage": stage, "round": round_, "parts": parts}
        self.history.append(entry | {"score": reached, "iou": iou})
        if self.report is not None:
            self.furthest = max(self.furthest, fraction)
            best = partial(self.assembled, self.best) if self.assembled and self.best is not None else None
            self.report(Progress(stage, round_, self.settings.rounds, parts, iou, self.furthest, best))
        if self.checkpoint is not None:
            self.checkpoint()

    def due(self, rows: Rows, iou: float) -> bool:
        """Whether the best so far misses the part budget or the target, or is larger than it need be."""
        assert self.best is not None
        most, target = self.settings.max_parts, self.settings.min_iou
        if most is not None and len(self.best) > most:
            return len(rows) < len(self.best)
        if target is None:
            return False
        reached = volume_iou(self.samples, self.best)
        return iou > reached if reached < target else iou >= target and len(rows) < len(self.best)
