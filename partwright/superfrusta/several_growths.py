"""A fit of several growths: each is mended, and the best is kept with what is better in the others.

What differs between two fits of a shape is what growth came upon, not how well parts were optimised then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

from partwright.errors import CancelledError
from partwright.methods import Checkpoint, Outcome, Progress
from partwright.superfrusta.mending import Mending
from partwright.superfrusta.objective import volume_iou
from partwright.superfrusta.recombining import recombined
from partwright.superfrusta.resfit import MENDED, ResidualFit
from partwright.superfrusta.samples import NOTHING, FitSamples, Rows
from partwright.superfrusta.side_by_side import SideBySide

_GROWN = 0.75  # of the work is done when all growths have ended


@dataclass
class SeveralGrowths:
    """Fills a search with the best of `settings.attempts` growths. The first is that of a fit of one."""

    search: ResidualFit

    def run(self, start: Rows = NOTHING) -> Outcome:
        search = self.search
        growths, converged = self.grown(start)
        if growths and search.settings.min_iou is None and not search.settings.curve:
            with search.timed("recombine"):
                self.recombine(growths)
        return search.finished(converged)

    def grown(self, start: Rows) -> tuple[list[ResidualFit], bool]:
        """The growths that came to anything, the best of them kept, and whether all converged."""
        search, began = self.search, perf_counter()
        alone = replace(search.settings, attempts=1)

        def growth(
            number: int, samples: FitSamples, checkpoint: Checkpoint, told: Callable[[Progress], None]
        ) -> tuple[ResidualFit, bool | None]:
            one = ResidualFit(samples, alone, told, search.locked, search.assembled, checkpoint)
            try:
                return one, one.grown(start)
            except CancelledError:
                one.choose()
                return one, None

        search.samples.find_symmetries()  # once, before growths side by side ask for them
        beside = SideBySide[tuple[ResidualFit, bool | None]](search.samples, search.checkpoint, self.told)
        found = beside(growth, search.settings.attempts)
        self.account([one for one, _ in found], perf_counter() - began)
        growths = [one for one, _ in found if one.best is not None]
        if growths:
            search.best = max(growths, key=lambda one: one.best_objective).best
        if any(ended is None for _, ended in found) and search.checkpoint is not None:
            search.checkpoint()
        self.judge([one.best for one in growths if one.best is not None])
        return growths, all(ended for _, ended in found)

    def told(self, step: Progress) -> None:
        search = self.search
        if search.report is not None:
            whole = MENDED if search.mending else 1.0
            search.furthest = max(search.furthest, _GROWN * step.fraction / whole)
            search.report(replace(step, fraction=search.furthest))

    def account(self, growths: Sequence[ResidualFit], spent: float) -> None:
        """Takes over what growths tell of themselves. Of the time that passed each stage has its share."""
        total = sum(sum(one.seconds.values()) for one in growths)
        for one in growths:
            self.search.history += one.history
            for stage, seconds in one.seconds.items():
                share = spent * seconds / max(total, 1e-9)
                self.search.seconds[stage] = self.search.seconds.get(stage, 0.0) + share

    def judge(self, found: Sequence[Rows]) -> None:
        """Keeps the best, all by samples of where any of them is astray."""
        for rows in found:
            self.search.sampled_strays(rows)
        self.search.best = None
        for rows in found:
            self.keep(rows)

    def recombine(self, growths: Sequence[ResidualFit]) -> None:
        """Exchanges groups of parts between growths, once as they were before they were mended, where most is
        still open, and once as they are."""
        search = self.search
        grown = [one.unmended for one in growths if one.unmended is not None]
        rows = search.thinning(self.exchanged(grown)) if grown else NOTHING
        if len(rows):
            self.tell(rows)
            mended = [one.best for one in growths if one.best is not None]
            found = self.mended(rows)
            self.keep(found)
            rows = self.exchanged([*mended, found])
            if rows is not search.best:
                self.keep(self.mended(rows))
        assert search.best is not None
        self.tell(search.best)

    def exchanged(self, found: Sequence[Rows]) -> Rows:
        """The best of these with what is better in the others."""
        search = self.search
        rows, *others = sorted(found, key=self.value, reverse=True)
        for other in others:
            rows = recombined(search.samples, rows, other, search.settings, self.value, search.locked)
        return rows

    def mended(self, rows: Rows) -> Rows:
        search = self.search
        if not search.mending:
            return rows
        return Mending(search.samples, search.settings, search.locked, self.tell)(rows)

    def tell(self, rows: Rows) -> None:
        self.search.report_progress("recombine", self.search.settings.rounds, rows, MENDED)

    def keep(self, rows: Rows) -> None:
        search = self.search
        if self.better(rows):
            search.best, search.best_objective = rows, search.objective(rows)

    def value(self, rows: Rows) -> float:
        """The objective of mending, or where nothing is mended that of growth."""
        search = self.search
        if not search.mending:
            return search.objective(rows)
        return Mending(search.samples, search.settings, search.locked).trial(rows).value

    def better(self, rows: Rows) -> bool:
        """Whether these rows take the place of the best, within a part budget and for a target."""
        search, settings = self.search, self.search.settings
        if search.best is None or search.due(rows, volume_iou(search.samples, rows)):
            return True
        if settings.min_iou is not None:
            return False
        most = settings.max_parts
        fits = most is None or len(rows) <= max(most, len(search.best))
        return fits and self.value(rows) > self.value(search.best)
