"""A tree of features read off a closed surface: a base body, then what is added to it and cut from it.

The surface's own sections and half sections are the bodies to choose from. What the chosen ones miss, and
what they have too much, is known exactly as a body of its own, and falls into pieces: a hole, a boss, a
pocket. Each piece is again a body whose sections can be extruded or turned. Whichever candidate raises R
most beyond its price joins, with as many copies as stand for other pieces, until none pays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from manifold3d import Manifold, Mesh
from numpy.typing import NDArray

from partwright.approximation.sketches.bodies import bodies
from partwright.approximation.sketches.candidate import AskedOnce, Candidate
from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.directions import frames
from partwright.approximation.sketches.drafts import leans
from partwright.approximation.sketches.ends import typed_reach
from partwright.approximation.sketches.pipe_paths import pipe_candidates
from partwright.approximation.sketches.teeth import FEATURE
from partwright.fields import Swept
from partwright.meshing.manifolds import simplified
from partwright.methods import Checkpoint
from partwright.shapes import Shape
from partwright.superfrusta.feature_bases import bases, is_nearly_whole, lacks_drafts, various
from partwright.superfrusta.feature_blanks import BEHIND, PERFECT, cut_from_blanks, worth
from partwright.superfrusta.feature_bores import bores, bores_of
from partwright.superfrusta.feature_copying import StepBodies, joined_by, with_copies
from partwright.superfrusta.feature_exchange import exchanged, rebased
from partwright.superfrusta.feature_linings import lines_a_hole
from partwright.superfrusta.feature_mending import mended
from partwright.superfrusta.feature_own_bodies import is_own_body
from partwright.superfrusta.feature_piece_candidates import PieceCandidates, stands_for
from partwright.superfrusta.feature_recasting import recast
from partwright.superfrusta.feature_steps import FeatureTree, Step, covers, within_box
from partwright.superfrusta.feature_symmetry import symmetries
from partwright.superfrusta.feature_weights import feature_weights
from partwright.superfrusta.samples import FitSamples

_FREE_SIDES = 4
_SIDE_PRICE = 1 / FEATURE  # of a feature's
_LEAST_PIECE = 2e-5  # of the volume
_SAME_PIECE = 0.01  # of a piece's volume, that one of the same form may be off
_THIN = 2.5e-3  # unit lengths: twice the volume over the area of a skin between a wall and its chords
_PIECES = 10  # of what is missed, and of what is too much, that are looked at in one step
_RIVAL = 0.55  # of the best base's objective, that another has to have
_PATIENT = 3  # steps after which a tree may be well behind
_SLOW = 6  # the same of a tree of bodies of the shape's own, which begins with a smaller one
_COMPLEX = 20_000  # triangles of a piece that is no feature
_MOST = 24
_FOR_MENDING = 10
_PLAIN = 6.0  # prices of plain features, with which no other base is tried
_TIE = 3e-4, 30_000  # of the objective, with so many samples: of what is as good, the plainest is taken
_LOOKED = 40  # candidates, by what they gain alone
_SHARE = 0.25  # of what the best candidate gains alone, that another that is tried with its copies gains
_BATCH = 64
_EVERY = 2  # samples that the search looks at
_FINE, _SKIN = 1500, 3e-4  # triangles of a piece that keeps them all, and unit lengths
_HOPELESS = 1.0  # of its price, that a feature can gain at most
_SHARE_OF_A_PATTERN = 0.4  # of that, that each of its copies can gain at most
_POOR = 0.95  # R that a tree of bodies of the shape's own has to reach


class FeatureSearch:
    """The search for one shape. alpha: price of a feature. most: features. told: of each tree on the way.
    mend: what becomes of a tree that is far off, by which trees are then told apart."""

    def __init__(
        self,
        shape: Shape,
        samples: FitSamples,
        alpha: float,
        checkpoint: Checkpoint | None = None,
        most: int | None = None,
        told: Callable[[FeatureTree], None] | None = None,
        mend: Callable[[FeatureTree], FeatureTree] | None = None,
    ) -> None:
        self.told, self.mend = told or (lambda tree: None), mend or (lambda tree: tree)
        self.samples, self.alpha, self.checkpoint = samples, alpha, checkpoint
        self.asked, self.most, self.limit = most, min(most or _MOST, _MOST), most or _MOST + _FOR_MENDING
        self.tie = _TIE[0] * math.sqrt(_TIE[1] / max(1, samples.near))
        self.reach = typed_reach(shape.frame.scale)
        vertices, faces = shape.unit_mesh
        self.body = Manifold(Mesh(vertices.astype(np.float32), faces.astype(np.uint32)))
        self.frames = frames(vertices, faces)
        self.volume = float(self.body.volume())
        self.points = samples.points[::_EVERY]
        self.weights = feature_weights(shape, samples)[::_EVERY]
        self.inside = samples.inside[::_EVERY]
        inside = self.inside[:, None]
        self._in_and_out = np.hstack([self.weights * inside, self.weights * ~inside])
        self._whole = self.weights[self.inside].sum(axis=0)
        directions = [frame[:, 2] for frame in self.frames]
        self.turns, self.mirrors = symmetries(self.body, directions, samples.surface, samples.away)
        self.candidates_of = PieceCandidates(self.frames)
        self.mask = AskedOnce(self._mask)
        self.opened = AskedOnce(self._opened)
        self._is_own = AskedOnce(partial(is_own_body, self))
        self._lines_a_hole = AskedOnce(lambda candidate: lines_a_hole(candidate.part, samples.measure))
        self._bores_of = AskedOnce(bores_of)
        self.step_bodies = StepBodies(self)

    def run(self) -> FeatureTree | None:
        """The best tree; None where the surface encloses nothing to take sections of."""
        if self.body.is_empty() or self.volume <= 0:
            return None
        own = [*candidates(self.body, self.frames, holes=True), *pipe_candidates(self.body)]
        if not own:
            return None
        gains = self.gains(self.empty, own, True)
        order = bases(own, gains)
        grown: list[FeatureTree] = []
        tried: set[tuple[float, ...]] = set()
        others = [candidate for candidate in own if not (candidate.cuts or candidate.usual)]
        for index in order:
            best = max(grown, key=lambda tree: tree.objective, default=None)
            drawn_aside = best is not None and lacks_drafts(best, own)
            is_rival = gains[index] >= _RIVAL * gains[order[0]] or (drawn_aside and leans(own[index].part))
            done = best is not None and self._is_done(best) and not drawn_aside
            if best is not None and (not is_rival or (done and not is_nearly_whole(own[index]))):
                if not drawn_aside:
                    break
                continue
            tried.add(own[index].key)
            grown.append(self.grown(self.extended(self.empty, own[index], True), others, best))
            if best is None and not self._is_done(grown[0]):
                grown += self._built_up(self.empty, own, others, gains, grown[0])
        if not grown:
            return None
        return rebased(self, cut_from_blanks(self, self._nearest(grown, others), others, tried), others)

    def _nearest(self, grown: Sequence[FeatureTree], others: Sequence[Candidate]) -> FeatureTree:
        """The best of trees, ended; where that is far off, the second where it is worth more."""
        first, *rest = sorted(grown, key=lambda tree: -tree.objective)[:2]
        best = self.ended(first, others)
        if not best.off or not rest or rest[0].objective < best.objective - best.off:
            return best
        return max(best, self.ended(rest[0], others), key=worth)

    def _is_done(self, tree: FeatureTree) -> bool:
        """Whether hardly anything is left that another base could do better, or more plainly."""
        return tree.score > PERFECT and tree.price <= _PLAIN * self.alpha

    def ended(self, tree: FeatureTree, others: Sequence[Candidate]) -> FeatureTree:
        """A tree that has grown, recast and mended."""
        return mended(self, recast(self, self.with_patterns(tree), others))

    @property
    def empty(self) -> FeatureTree:
        """Of nothing yet."""
        return FeatureTree(covered=np.zeros(len(self.inside), bool), missed=self.body)

    def _built_up(
        self,
        empty: FeatureTree,
        own: Sequence[Candidate],
        others: Sequence[Candidate],
        gains: NDArray[np.float64],
        best: FeatureTree,
    ) -> list[FeatureTree]:
        """The tree of bodies that are the shape's own, the largest first, as long as there are any, and then
        of all else: rings with balls are not cut from an outline. None where it explains too little, or saves
        less than a feature: a counterbore is no wide hole with a ring in it."""
        order = np.argsort(-gains).tolist()
        first = next((i for i in order if self._is_own(own[i])), None)
        if first is None:
            return []
        tree = self.grown(self.extended(empty, own[first], True), others, best, True, _SLOW)
        tree = self.grown(tree, others, best)
        better = tree.objective > best.objective + self.alpha
        return [tree] if tree.score >= _POOR and better else []

    def grown(
        self,
        tree: FeatureTree,
        own: Sequence[Candidate],
        best: FeatureTree | None,
        only_own: bool = False,
        patient: int = _PATIENT,
        most: int | None = None,
    ) -> FeatureTree:
        """Until nothing pays, it has the most steps, or is well behind where the best so far was after as
        many; on from where better bodies stand in place of some, but for a tree that is behind.

        only_own: of what is added, only bodies that are the shape's own."""
        tree = self._grown(tree, own, best, only_own, patient, most)
        if best is not None and self.is_behind(tree, best, patient):
            return tree
        other = exchanged(self, tree, own)
        return tree if other is tree else self._grown(other, own, best, only_own, patient, most)

    def _grown(
        self,
        tree: FeatureTree,
        own: Sequence[Candidate],
        best: FeatureTree | None,
        only_own: bool,
        patient: int,
        most: int | None,
    ) -> FeatureTree:
        while len(tree.features) < self.most and (most is None or len(tree.steps) < most):
            step = self.step(tree, own, only_own)
            if step is None:
                break
            tree = step
            self.told(tree)
            if best is not None and self.is_behind(tree, best, patient):
                break
        return tree

    def with_patterns(self, tree: FeatureTree) -> FeatureTree:
        """With what pays by its copies only, such as four small holes."""
        while len(tree.features) < self.most:
            step = self.step(tree, (), patterns=True)
            if step is None:
                break
            tree = step
        return tree

    @staticmethod
    def is_behind(tree: FeatureTree, best: FeatureTree, patient: int) -> bool:
        """Whether it is well behind where the best was after as many steps, or far behind before."""
        count = len(tree.steps)
        rival = best.steps[min(count, len(best.steps)) - 1].objective
        return count >= _PATIENT and tree.objective < rival - BEHIND * max(1, patient + 2 - count)

    def step(
        self,
        tree: FeatureTree,
        own: Sequence[Candidate],
        only_own: bool = False,
        banned: tuple[float, ...] | None = None,
        patterns: bool = False,
    ) -> FeatureTree | None:
        """The tree and what raises R most beyond its price, but for the candidate of one key.

        patterns: also what does so with its copies only."""
        if self.checkpoint is not None:
            self.checkpoint()
        pieces = {
            True: self._pieces(tree.missed, self.inside & ~tree.covered, patterns),
            False: self._pieces(tree.excess, ~self.inside & tree.covered, patterns),
        }
        pools: dict[bool, list[Candidate]] = {True: [], False: []}
        found: dict[bool, list[tuple[float, Candidate, bool]]] = {True: [], False: []}

        def look_at(pool: Sequence[Candidate], added: bool) -> None:
            if added:
                pool = [c for c in pool if not (c.beyond or self._lines_a_hole(c))]
                pool = [c for c in pool if self._is_own(c)] if only_own else pool
            pool = [c for c in pool if c.key != banned]
            pools[added] += pool
            gains = self.gains(tree, pool, added).tolist() if pool else ()
            found[added] += [(gain, c, added) for gain, c in zip(gains, pool, strict=True)]

        def enough() -> float:
            """What a candidate has to gain to be tried with its copies."""
            return max(0.0, _SHARE * max((gain for own in found.values() for gain, *_ in own), default=0.0))

        look_at(own, True)
        look_at(bores(tree.steps, self._bores_of), False)
        largest = sorted(((*one, added) for added, own in pieces.items() for one in own), key=lambda p: -p[0])
        for most, piece, added in largest:
            if patterns or most - self.alpha > enough():
                look_at(self.candidates_of(piece), added)
        rivals = [rival for own in found.values() for rival in sorted(own, key=lambda one: -one[0])[:_LOOKED]]
        rivals.sort(key=lambda rival: -rival[0])

        alone = {added: [piece for _, piece in own] for added, own in pieces.items()}

        def may_pay(gain: float, chosen: Candidate, added: bool) -> bool:
            if not patterns:
                return gain > enough()
            price, like_it = self.price(chosen.sides), self._alike(chosen, alone[added])
            return (gain + price) * like_it > price

        steps = [
            with_copies(self, tree, chosen, added, alone[added], pools[added])
            for gain, chosen, added in various(rivals)
            if may_pay(gain, chosen, added)
        ]
        paying = [step for step in steps if step.objective > tree.objective]
        least = max((step.objective for step in paying), default=0.0) - self.tie
        good = [step for step in paying if step.objective >= least]
        plain = min(good, key=_plainness, default=None)
        return joined_by(self, tree, plain) if plain is not None else None

    def _alike(self, chosen: Candidate, pieces: Sequence[Manifold]) -> int:
        """How many pieces are of the form of the one that a candidate stands for.

        0 where it is of none, or no plain one: what chords leave of a bend is there often, but not drawn."""
        if chosen.sides > _FREE_SIDES:
            return 0
        own = next((p for p in pieces if any(c is chosen for c in self.candidates_of(p))), None)
        if own is None or not stands_for(chosen, own):
            return 0
        volume = own.volume()
        return sum(abs(piece.volume() - volume) <= _SAME_PIECE * volume for piece in pieces)

    def extended(
        self, tree: FeatureTree, chosen: Candidate, added: bool, pieces: Sequence[Manifold] = ()
    ) -> FeatureTree:
        """The tree and a candidate, with the copies that stand for other pieces."""
        return joined_by(self, tree, with_copies(self, tree, chosen, added, pieces))

    def price(self, sides: int) -> float:
        """Of a feature whose profile has so many sides, with all its copies."""
        return self.alpha * (1 + _SIDE_PRICE * max(0, sides - _FREE_SIDES))

    def _pieces(
        self, residual: Manifold, wrong: NDArray[np.bool_], patterns: bool
    ) -> list[tuple[float, Manifold]]:
        """Connected pieces that may pay and are no skin, the largest first, each after what R it can bring
        at most. wrong: the samples in them. patterns: may pay by a share, where others of their form do so,
        too."""
        points, weight = self.points[wrong], self.weights[wrong]
        found = [
            (volume, piece)
            for volume, piece in bodies(residual, _LEAST_PIECE * self.volume, _THIN)
            if piece.num_tri() <= _COMPLEX
        ]
        least = _HOPELESS * self.alpha * (_SHARE_OF_A_PATTERN if patterns else 1.0)

        def most(piece: Manifold) -> float:
            within = within_box(points, *np.reshape(piece.bounding_box(), (2, 3)))
            return float((weight[within].sum(axis=0) / self._whole).mean())

        known = [(volume, most(piece), piece) for volume, piece in found]
        paying = np.array([volume for volume, gain, _ in known if gain > least])
        # One of a row may have few samples by chance: it is a copy of what pays.
        pieces = [one for one in known if (np.abs(paying - one[0]) <= _SAME_PIECE * one[0]).any()]
        largest = sorted(pieces, key=lambda one: -one[0])[:_PIECES]
        return [
            (gain, piece if piece.num_tri() < _FINE else simplified(piece, _SKIN))
            for _, gain, piece in largest
        ]

    def _mask(self, candidate: Candidate) -> NDArray[np.float32]:
        """(N,) 1 at the samples within."""
        return (covers(candidate.part, self.points) & ~self.opened(candidate)).astype(np.float32)

    def _opened(self, candidate: Candidate) -> NDArray[np.bool_]:
        """(N,) the samples that the cuts of a candidate take away."""
        none = np.zeros(len(self.points), bool)
        return np.logical_or.reduce([none, *(covers(cut, self.points) for cut in candidate.cuts)])

    def gains(
        self,
        tree: FeatureTree,
        pool: Sequence[Candidate],
        added: bool,
        free: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """(C,) by how much each raises R beyond its price. free: (N,) the samples that it can change, all
        where it is None."""
        both, either = self._overlap(tree.covered)
        changes = ~tree.covered if added else tree.covered
        changes = changes if free is None else changes & free
        columns = (self._in_and_out * changes[:, None]).astype(np.float32)
        sign = 1.0 if added else -1.0
        scores = []
        for start in range(0, len(pool), _BATCH):
            masks = np.stack([self.mask(c) for c in pool[start : start + _BATCH]])
            change = sign * (masks @ columns)
            ratio = (both + change[:, :2]) / np.maximum(either + change[:, 2:], 1e-9)
            scores.append(ratio.mean(axis=1))
        price = np.array([self.price(c.sides) for c in pool])
        gained = np.concatenate(scores) - tree.score - price
        for k, candidate in enumerate(pool if tree.steps else ()):
            if candidate.cuts:
                behind = tree.behind(self.mask(candidate) > 0)
                gained[k] = self.score_of(behind) - tree.score - price[k]
        return gained

    def scored(self, tree: FeatureTree) -> FeatureTree:
        """The tree with its score and price."""
        price = sum(self.price(feature.sides) for feature in tree.features)
        return replace(tree, score=self.score_of(tree.at(self.points)), price=price)

    def score_of(self, covered: NDArray[np.bool_]) -> float:
        """R of what covers such samples (N,)."""
        both, either = self._overlap(covered)
        return float((both / np.maximum(either, 1e-9)).mean())

    def _overlap(self, covered: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(2,) of what covers such samples (N,) and the shape: weights of both together, and of either."""
        sums = covered.astype(np.float64) @ self._in_and_out
        return sums[:2], self._whole + sums[2:]


def _plainness(step: Step) -> tuple[int, bool, bool]:
    """The less, the plainer; of what is as plain, what takes all of a piece leaves no chip."""
    return step.chosen.sides, not step.chosen.beyond, isinstance(step.part.field, Swept)
