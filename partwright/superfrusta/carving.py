"""Attempts of a search with parts to subtract, for shapes that have holes or are hollow.

Growth that adds builds walls around a hole. What cuts make of shapes without holes is worse, or takes more
parts: which it is shows after a few rounds, between attempts with as many parts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import CancelledError
from partwright.superfrusta.frontier import Frontier
from partwright.superfrusta.growing import carve
from partwright.superfrusta.hollows import with_hollows_filled
from partwright.superfrusta.hull_start import convex_hull_start
from partwright.superfrusta.mending import Mending
from partwright.superfrusta.recombining import recombined
from partwright.superfrusta.samples import NOTHING, Rows
from partwright.superfrusta.settings import Settings

if TYPE_CHECKING:
    from partwright.superfrusta.resfit import ResidualFit

_OPENING = 4  # rounds of an attempt that subtracts, after which it is compared
_FIRST = 2  # rounds of the one that only adds, before another is begun beside it
_PROMISING = 0.88  # of the objective at a usual price: where it has reached that by then, none is begun
_GOOD = 0.93  # likewise, when it has ended: what is worse is tried again with parts to subtract
_AHEAD = 0.05  # of the objective, at the same number of parts: what leads by so much is gone on with alone
_TO_COME = 0.15  # of the objective: what growth that adds may gain yet after its first rounds
_TELLING = 0.6  # of the objective: of a shape that so few parts explain less of, the lead says nothing
_OTHERS = 3  # attempts at most, the best of them, that parts are taken from
_WORTH_CUTS = 0.01  # of the objective that parts to subtract must gain, for they are the harder to edit


@dataclass
class Carving:
    """What a search tries with parts to subtract; what is best of it becomes the search's best."""

    search: ResidualFit

    @property
    def allowed(self) -> bool:
        settings = self.search.settings
        return settings.subtract is None and settings.carving and settings.rounds > _OPENING

    @property
    def settings(self) -> Settings:
        """Those of an attempt that subtracts."""
        settings = self.search.settings
        return replace(settings, subtract=True, regions=max(1, settings.regions - 2))

    def contest(self) -> bool:
        """Growth that adds beside growth that subtracts, from nothing, the first to its end where the other
        is not clearly ahead by then, or has come to nothing good that the first may not reach yet; says
        whether the growth of what is kept converged."""
        search = self.search
        rounds = search.settings.rounds
        rows, converged = search.growth(NOTHING, range(_FIRST))
        cut = self.opened() if search.best is not None and self.usual_objective <= _PROMISING else NOTHING
        if len(cut) and self.lead(cut) > _AHEAD and search.objective(cut) > _TELLING:
            added, settings = search.best, search.settings
            carved = self.tried(cut)
            if search.best is not added:
                assert added is not None
                far = search.best_objective > search.objective(added) + _TO_COME
                done = far or self.usual_objective > _GOOD
                return carved if done else self.rejoined(rows, settings, carved)
            cut = NOTHING
        if not converged:
            rows, converged = search.growth(rows, range(_FIRST, rounds))
        search.thin(rows)
        return converged if search.best is None else self.tried(cut) and converged

    def rejoined(self, rows: Rows, settings: Settings, converged: bool) -> bool:
        """Growth that adds goes on after all, by its own settings, beside what was carved and converged or
        not; says so of what is kept."""
        search, carved = self.search, self.search.best
        carving, search.settings = search.settings, settings
        # What was carved has most of its parts from rounds that this growth has yet to come to.
        search.reached, search.reached_before = Frontier(), Frontier()
        try:
            added = search.attempt(rows, _FIRST)
        finally:
            search.choose()
            if search.best is carved:
                search.settings = carving
        return converged if search.best is carved else added

    def opened(self) -> Rows:
        """A few rounds that subtract, from nothing."""
        search = self.search
        opening = search.another(replace(self.settings, rounds=_OPENING))
        opening.growth(NOTHING)
        search.take_samples(opening.samples)
        return NOTHING if opening.best is None else opening.best

    def lead(self, rows: Rows) -> float:
        """How far rows are ahead of what the search has grown."""
        return self.search.reached.lead(len(rows), self.search.objective(rows))

    @property
    def usual_objective(self) -> float:
        """Of the search's best, at a usual price of a part."""
        search = self.search
        assert search.best is not None
        return search.best_objective + (search.settings.price - Settings().alpha) * len(search.best)

    def tried(self, cut: Rows = NOTHING) -> bool:
        """Attempts that subtract, where the best is not good: on from what opened, else from nothing, and
        from the body that is hollowed out; says whether the growth of what is kept converged."""
        search, settings, converged = self.search, self.settings, True
        if self.usual_objective <= _GOOD and not (len(cut) and search.is_behind(self.lead(cut))):
            converged = self.attempted(cut, settings, _OPENING if len(cut) else 0)
        if self.usual_objective <= _GOOD:
            body = self.hollowed(settings)
            converged = (self.attempted(body, settings) if len(body) else True) and converged
        return converged

    def attempted(self, start: Rows, carving: Settings, first: int = 0) -> bool:
        """One such attempt, kept if it is clearly better; says whether the growth of what is kept
        converged."""
        search = self.search
        settings, search.settings = search.settings, carving
        search.rival = search.best_objective + (0.0 if settings.subtract else _WORTH_CUTS)
        whole, converged = search.best, True
        try:
            converged = search.attempt(start, first)
        finally:
            if search.best_objective < search.rival:
                search.best = None
            search.choose()
            if search.best is whole:
                search.settings = settings
        return converged or search.best is whole

    def recombined(self, rows: Rows) -> Rows:
        """With groups of parts of other attempts in place of some, where that serves what mending serves.

        What was given up as a whole has often found what the best has not: a cut that empties a ring.
        """
        search, settings = self.search, self.search.settings
        others = list({id(one): one for one in search.attempts if one is not rows}.values())
        if not others or settings.min_iou is not None or settings.curve:
            return rows
        most = max(len(rows), settings.max_parts or len(search.samples.points))
        mending = Mending(search.samples, settings, search.locked)

        def value(trial: Rows) -> float:
            return mending.trial(trial).value if len(trial) <= most else -np.inf

        found = rows
        with search.timed("recombine"):
            for other in sorted(others, key=search.objective, reverse=True)[:_OTHERS]:
                found = recombined(search.samples, found, other, settings, value, search.locked)
        if found is rows:
            return rows
        thinned = search.another(replace(settings, merging=False))
        found = thinned.thinning(found)  # what came may make others vain
        search.take_samples(thinned.samples)
        return found

    def started(self) -> Rows:
        """Where parts may be subtracted from the first round on: a few rounds from nothing and from bodies to
        carve from; whichever gets furthest."""
        search = self.search
        brief = replace(search.settings, rounds=min(_OPENING, search.settings.rounds))
        tried: list[Rows] = []
        for start in (NOTHING, convex_hull_start(search.samples, search.settings), self.hollowed(brief)):
            if tried and not len(start):
                continue
            opening = search.another(brief)
            try:
                opening.growth(start)
            except CancelledError:
                found = tried if opening.best is None else [*tried, opening.best]
                search.best = max(found, key=search.objective, default=search.best)
                raise
            search.take_samples(opening.samples)
            if opening.best is not None:
                tried.append(opening.best)
        return max(tried, key=search.objective) if tried else NOTHING

    def hollowed(self, settings: Settings) -> Rows:
        """The body that fits the shape with its hollows filled, and what is taken out of it; nothing where
        there are none."""
        search = self.search
        filled = with_hollows_filled(search.samples)
        if filled is None:
            return NOTHING
        full = search.another(replace(settings, subtract=False, rounds=min(_OPENING, settings.rounds)), 0)
        full.samples = filled
        full.growth(NOTHING)
        if full.best is None:
            return NOTHING
        body = full.thinning(full.best)
        with search.timed("grow"):
            cuts = carve(search.samples, body, settings, settings.regions)
        return cuts.joined(body, 0)
