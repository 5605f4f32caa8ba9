"""One way to a CSG tree of quadrics: detect, select, prune (schedule "search"), or the paper's network."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.capri import oriented_points, selection
from partwright.capri import quadric_rows as rows
from partwright.capri import samples as sampling
from partwright.capri.alignment import aligned
from partwright.capri.candidates import CandidatePool, candidates
from partwright.capri.csg_tree import CsgTree
from partwright.capri.detection import detect
from partwright.capri.initialisation import start_surface
from partwright.capri.overlap import overlapped
from partwright.capri.repeated_convexes import with_repeated_convexes
from partwright.capri.samples import OccupancySamples
from partwright.capri.selection import Problem
from partwright.capri.settings import Settings
from partwright.capri.strays import strays
from partwright.errors import MissingDependencyError, SettingError
from partwright.methods import Checkpoint, Outcome, Progress, Run, timed
from partwright.shapes import Shape
from partwright.shapes.frame import LONGEST_SIDE

_MAX_CONVEXES = 64  # convexes: the paper's c (section 4.1)
_PRICE_FACTOR = 1.5  # factor between the prices that are tried for a budget or a target
_PRICE_STEPS = 16  # prices that are tried at most
_OFFERED_PRICE = 0.3  # times the prices, at which convexes are found that may pay as one with copies
_MAX_OFFERED = 24  # of these: more of a pattern are where the motions between them lead on
_SEARCHED = 0.9  # of the expected work, where copies are sought after the search
_STAGES = {"select": (0.1, 0.4), "recreate": (0.4, 0.9), "mend": (0.9, 1.0)}  # of the expected work
_FAR_OFF = 0.03 * LONGEST_SIDE  # from which on a place is mended
_MENDINGS = 3  # times that the tree is asked again for places that are far off
_MOST_PLACES = 10
_MENDED_PRICE = 1.5  # times the prices of a convex and a primitive: what such a place costs
_MENDING_TRIES = 8  # each time, convexes are taken out and replaced so many times


@dataclass
class TreeSearch:
    """State of one search from one origin: the samples, the pool, and the cheapest layers so far.

    turn: which of how many searches this is. tuned: what the paper's schedule made. dearer: times the
    settings' prices, at which the demands were met.
    """

    settings: Settings
    run: Run = field(default_factory=Run)
    checkpoint: Checkpoint | None = None
    origin: str = "seeds"
    turn: tuple[int, int] = (0, 1)
    assembled: Callable[[CsgTree], Assembly] | None = None
    best: selection.Layers | None = None
    tuned: CsgTree | None = None
    outcome: Outcome = "converged"
    dearer: float = 1.0
    seconds: dict[str, float] = field(default_factory=dict)
    history: list[dict[str, float | str]] = field(default_factory=list)
    pool: CandidatePool = field(init=False)
    samples: OccupancySamples = field(init=False)
    box: tuple[NDArray[np.float64], NDArray[np.float64]] = field(init=False)

    def timed(self, stage: str) -> AbstractContextManager[None]:
        return timed(self.seconds, stage)

    def prepare(self, shape: Shape, start: Assembly | None) -> None:
        """Samples, and the pool of quadrics."""
        s = self.settings
        corners = shape.frame.to_unit(shape.vertices)
        self.box = corners.min(axis=0), corners.max(axis=0)
        with self.timed("prepare"):
            self.samples = sampling.draw_samples(shape, s.near, s.uniform, self.run.seed)
            surface = oriented_points.sample_surface(shape, s.surface, self.run.seed)
        with self.timed("detect" if self.origin == "seeds" else "predict"):
            found = detect(surface, s.kinds, s.least, self.run.seed) if self.origin == "seeds" else []
            found = aligned(found, surface)
            if start is not None:
                seen = start_surface(start, shape, s.surface, self.run.seed)
                found = [*found, *aligned(detect(seen, s.kinds, s.least, self.run.seed), seen)]
            given = candidates(found, surface)
            if self.origin == "weights":
                given += list(paper_schedule().predicted(shape, s))
            pool = CandidatePool.of(given, nested=s.nested, oriented=s.oriented)
            held = rows.expressible(pool.rows) | (s.schedule == "search")
            self.pool = CandidatePool(pool.rows[held], pool.complement[held])
            self.look_at_samples()

    def look_at_samples(self) -> None:
        """Which quadric leaves which sample out."""
        self.outside = (rows.values(self.pool.rows, self.samples.points) > 0).astype(np.float32)

    def make(self, shape: Shape) -> None:
        """The tree: by search, by the paper's schedule, or by this from that."""
        s = self.settings
        if s.schedule == "search" or self.origin == "seeds":
            self.outcome = self.search(shape)
        if s.schedule == "paper":
            with self.timed("fine-tune"):
                seeds = self.tree() if self.placed else None
                if seeds is not None or self.origin == "weights":
                    paper_schedule().fine_tuned(
                        shape,
                        seeds,
                        s,
                        self.run,
                        self.samples.points,
                        self.accept_tuned,
                        self.report_finetuning,
                        self.pause,
                    )

    @property
    def placed(self) -> bool:
        """Whether there is a tree."""
        return bool(self.tuned.layers[0]) if self.tuned else bool(self.best and any(self.best))

    def accept_tuned(self, tree: CsgTree) -> None:
        """The result of fine-tuning, where it is no empty tree."""
        if tree.layers[0]:
            self.tuned = tree

    def report_finetuning(self, stage: str, done: float) -> None:
        """Progress of fine-tuning."""
        self.run.told(Progress(stage, 1, 1, 0, 0.0, self.fraction(0.3 + 0.7 * done)))

    def pause(self) -> None:
        """Where the search may end, if it was cancelled."""
        if self.checkpoint is not None:
            self.checkpoint()

    def fraction(self, done: float) -> float:
        """Of all runs, where this one has done so much of its search."""
        return (_SEARCHED if self.repeats else 1.0) * (self.turn[0] + done) / self.turn[1]

    @property
    def repeats(self) -> bool:
        """Whether copies are sought among the convexes."""
        return self.settings.symmetry and self.settings.schedule == "search"

    def cost(self) -> float:
        """Of the tree: weight on the wrong side as a share of the shape's, and the description length."""
        tree, s = self.tree(), self.settings
        return self.error(tree) + s.price * tree.primitives + s.convex_price * tree.convexes

    def error(self, tree: CsgTree) -> float:
        """The weight on the wrong side as a share of the shape's."""
        wrong = self.samples.weight[tree.occupancy(self.samples.points) != self.samples.inside]
        return float(wrong.sum(dtype=np.float64)) / self.samples.volume

    def problem(self, dearer: float = 1.0) -> Problem:
        """The selection at the settings' prices, times a factor."""
        s, volume = self.settings, self.samples.volume
        price = np.where(self.pool.complement, s.price + s.convex_price, s.price)
        return Problem(
            self.outside,
            self.samples.inside,
            self.samples.weight,
            dearer * volume * price,
            dearer * volume * s.convex_price,
            np.random.default_rng((self.run.seed, 3)),
            self.pause,
        )

    def search(self, shape: Shape) -> Outcome:
        """Starts that forgive false positives more or less, the best ruined and recreated, and mended where
        it is far off; then demands."""
        s = self.settings
        problem = self.problem()
        empty: selection.Layers = [[] for _ in range(2 if s.subtract else 1)]
        with self.timed("select"):
            weights = selection.FALSE_POSITIVE_WEIGHTS
            for i, weight in enumerate(weights):
                layers = selection.fill(problem, empty, weight, _MAX_CONVEXES)
                layers = selection.polish(problem, layers, _MAX_CONVEXES)
                self.keep_cheaper(problem, layers, "select", i + 1, len(weights))
        if self.best is None:
            return "converged"
        with self.timed("recreate"):
            for i in range(s.tries):
                layers = selection.ruin_and_recreate(problem, self.best, _MAX_CONVEXES)
                self.keep_cheaper(problem, layers, "recreate", i + 1, s.tries)
        with self.timed("mend"):
            self.mend(shape)
        return self.meet_demands()

    def mend(self, shape: Shape) -> None:
        """Asks again for a tree where it is far off, with samples of these places beside the others; the tree
        that is the least far off stays."""
        s = self.settings
        cost = _MENDED_PRICE * (s.price + s.convex_price) * self.samples.volume
        kept, least = self.best, np.inf
        try:
            for round_ in range(_MENDINGS + 1):
                places = strays(self.bounded_tree(), shape, _FAR_OFF, self.run.seed)[:_MOST_PLACES]
                off = max((place.off for place in places), default=0.0)
                if off < least:
                    kept, least = self.best, off
                if not places or round_ == _MENDINGS:
                    break
                for place in places:
                    self.samples = self.samples.with_points(place.points, place.inside, cost)
                self.look_at_samples()
                problem = self.problem()
                self.best = selection.polish(problem, self.best or [], _MAX_CONVEXES)
                if not any(self.best):
                    break
                for i in range(_MENDING_TRIES):
                    layers = selection.ruin_and_recreate(problem, self.best, _MAX_CONVEXES)
                    done = round_ * _MENDING_TRIES + i + 1
                    self.keep_cheaper(problem, layers, "mend", done, _MENDINGS * _MENDING_TRIES)
        finally:
            self.best = kept

    def meet_demands(self) -> Outcome:
        """Dearer, until the budget is met; cheaper or dearer, until the target is only just met."""
        s = self.settings
        assert self.best is not None
        with self.timed("demands"):
            if s.min_iou is not None:
                return self.meet_target(s.min_iou)
            if s.max_parts is None or self.bounded_tree().primitives <= s.max_parts:
                return "converged"
            for i in range(1, _PRICE_STEPS):
                fewest = self.bounded_tree().primitives
                self.dearer = _PRICE_FACTOR**i
                self.best = selection.polish(self.problem(self.dearer), self.best, _MAX_CONVEXES)
                if not any(self.best):
                    break
                if self.bounded_tree().primitives <= s.max_parts:
                    return "budget_reached"
            raise SettingError(
                f"max_parts: {s.max_parts} quadrics enclose nothing of it; the smallest tree that was found "
                f"has {fewest}, so give more"
            )

    def meet_target(self, target: float) -> Outcome:
        """The dearest prices at which the IoU of the samples reaches the target."""
        best = self.best
        for i in range(_PRICE_STEPS // 2, -_PRICE_STEPS // 2, -1):
            problem = self.problem(_PRICE_FACTOR**i)
            layers = selection.polish(problem, best or [], _MAX_CONVEXES)
            if self.iou(problem.occupancy(layers)) >= target:
                self.best, self.dearer = layers, _PRICE_FACTOR**i
                return "target_reached"
        return "converged"

    def keep_cheaper(
        self, problem: Problem, layers: selection.Layers, stage: str, round_: int, rounds: int
    ) -> None:
        """Keeps layers that are cheaper than the best so far, and reports progress."""
        if any(layers) and (self.best is None or problem.cost(layers) < problem.cost(self.best)):
            self.best = layers
        tree = self.tree() if self.best else None
        parts, iou = 0, 0.0
        if tree and self.best:
            parts, iou = tree.primitives, self.iou(problem.occupancy(self.best))
        self.history.append({"stage": stage, "round": round_, "parts": parts, "iou": iou})
        begin, end = _STAGES[stage]
        done = begin + (end - begin) * round_ / rounds
        done *= 0.3 if self.settings.schedule == "paper" else 1.0
        best = partial(self.assembled, tree) if tree and self.assembled else None
        self.run.told(Progress(stage, round_, rounds, parts, iou, self.fraction(done), best))
        self.pause()

    def iou(self, occupied: NDArray[np.bool_]) -> float:
        """Of a side for each sample (N,): IoU over the uniform ones."""
        rest = slice(self.samples.near, self.samples.near + self.samples.uniform)
        occupied, inside = occupied[rest], self.samples.inside[rest]
        return float((occupied & inside).sum() / max((occupied | inside).sum(), 1))

    def bounded_tree(self) -> CsgTree:
        """The tree, which ends within the box of the shape, as it becomes the assembly: the unit frame."""
        return overlapped(self.tree().closed(*self.box), self.samples)

    def final_tree(self) -> CsgTree:
        """The bounded tree with alike convexes as copies of one, where no demand is left unmet for that.

        Raises:
            CancelledError: cancelled while copies were sought.
        """
        if not self.repeats:
            return self.bounded_tree()
        with self.timed("repeat"):
            found = self.tree().closed(*self.box)
            self.report_repeats(found, 1)
            copied = self.with_copies(found)
            self.report_repeats(copied or found, 2)
        return overlapped(copied or found, self.samples)

    def with_offered(self) -> CsgTree | None:
        """The tree and convexes that would pay at lower prices, as each of many small holes would; None where
        there are none."""
        assert self.best is not None
        count = sum(map(len, self.best))
        most = min(count + _MAX_OFFERED, _MAX_CONVEXES)
        layers = selection.fill(self.problem(_OFFERED_PRICE * self.dearer), self.best, 1.0, most)
        if sum(map(len, layers)) == count:
            return None
        return CsgTree(self.pool.rows, self.pool.complement, tuple(map(tuple, layers))).closed(*self.box)

    def with_copies(self, tree: CsgTree) -> CsgTree | None:
        """The tree with copies, or with more convexes that pay as one with theirs, whichever is the cheaper;
        without further copies where both go beyond a demand, None where that does, too."""
        offered = self.with_offered()
        starts = (tree,) if offered is None else (offered, tree)
        met = [copied for start in starts if (copied := self.copied(tree, start, True)) is not None]
        return min(met, key=self.cost_of_copied, default=None) or self.copied(tree, tree, False)

    def copied(self, tree: CsgTree, start: CsgTree, further: bool) -> CsgTree | None:
        """start, which is the tree and perhaps more convexes, with copies; None where it goes beyond a
        demand."""
        s, factor = self.settings, self.dearer
        least = 0.0 if s.min_iou is None else min(s.min_iou, self.iou(tree.occupancy(self.samples.points)))
        own = tuple(map(len, tree.layers))
        found = with_repeated_convexes(
            start, self.samples, factor * s.price, factor * s.convex_price, self.pause, further, own
        )
        # Fitting to all places may drop what ended a convex where no sample is.
        found = found.closed(*self.box)
        if s.max_parts is not None and found.primitives > s.max_parts:
            return None
        return found if self.iou(found.occupancy(self.samples.points)) >= least else None

    def cost_of_copied(self, tree: CsgTree) -> float:
        """As `cost`, with a copy at the price of a primitive and the prices at which demands are met."""
        s, length = self.settings, 0.0
        for k, layer in enumerate(tree.layers):
            for i, convex in enumerate(layer):
                if tree.copies and tree.copies[k][i] is not None:
                    length += s.price
                else:
                    convexes = 1 + int(tree.complement[list(convex)].sum())
                    length += s.price * len(convex) + s.convex_price * convexes
        return self.error(tree) + self.dearer * length

    def report_repeats(self, tree: CsgTree, round_: int) -> None:
        """Progress of the search for copies; a tree before it, and after."""
        iou = self.iou(tree.occupancy(self.samples.points))
        best = partial(self.assembled, tree) if self.assembled else None
        done = _SEARCHED if round_ == 1 else 1.0
        self.run.told(Progress("repeat", round_, 2, tree.primitives, iou, done, best))
        self.pause()

    def tree(self) -> CsgTree:
        if self.tuned is not None:
            return self.tuned
        assert self.best is not None
        layers = tuple(tuple(layer) for layer in self.best)
        return CsgTree(self.pool.rows, self.pool.complement, layers)


def paper_schedule() -> ModuleType:
    """The module of the network, which needs PyTorch."""
    try:
        return import_module("partwright.capri.paper")
    except ModuleNotFoundError as error:
        if error.name != "torch":
            raise
        message = 'the network of CAPRI-Net needs PyTorch: pip install "partwright[torch]"'
        raise MissingDependencyError(message) from error
