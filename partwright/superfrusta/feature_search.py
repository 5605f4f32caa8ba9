"""A tree of features read off a closed surface: a base body, then what is added to it and cut from it.

The surface's own sections and half sections are the bodies to choose from. What the chosen ones miss, and
what they have too much, is known exactly as a body of its own, and falls into pieces: a hole, a boss, a
pocket. Each piece is again a body whose sections can be extruded or turned. Whichever candidate raises R
most beyond its price joins, with as many copies as stand for other pieces, until none pays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from manifold3d import Manifold, Mesh
from numpy.typing import NDArray

from partwright.approximation.sketches.bodies import bodies
from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.directions import frames
from partwright.approximation.sketches.open_sides import with_open_sides
from partwright.approximation.sketches.repeats import moves_between
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.meshing.csg import solid_of
from partwright.methods import Checkpoint
from partwright.shapes import Shape
from partwright.superfrusta.feature_mending import farthest, mended
from partwright.superfrusta.samples import FitSamples

_FREE_SIDES = 4
_SIDE_PRICE = 1 / 25  # of a feature's
_LEAST_PIECE = 2e-5  # of the volume
_THIN = 2.5e-3  # unit lengths: twice the volume over the area of a skin between a wall and its chords
_PIECES = 10  # of what is missed, and of what is too much, that are looked at in one step
_BASES = 4
_RIVAL = 0.55  # of the best base's objective, that another has to have
_BEHIND, _PATIENT = 0.03, 3  # of the objective, after so many steps
_COMPLEX = 20_000  # triangles of a piece that is no feature
_MOST = 24
_FOR_MENDING = 10
_MOST_LOOKED = 150  # pieces whose candidates are made: a part of hundreds is no part that was drawn
_PERFECT = 0.985  # R from which on no other base is tried
_COPY = 0.4  # of what the first gains, that a copy has to
_BATCH = 64
_OWN, _ASKEW = 2, 0.9995  # directions of a piece, and the cosine to others that a new one has at most
_CHORD = 1e-3  # unit lengths: how far chords of a cut with moved sides may be off
_EVERY = 2  # samples that the search looks at
_FINE, _SKIN = 1500, 3e-4  # triangles of a piece that keeps them all, and unit lengths
_HOPELESS = 1.0  # of its price, that a feature can gain at most


@dataclass(frozen=True)
class Feature:
    """One step of the tree. covers: (N,) the samples within any copy."""

    added: bool
    part: Part
    covers: NDArray[np.bool_]
    sides: int


@dataclass
class FeatureTree:
    """Features in order, and the samples (N,) within their fold.

    missed, excess: what of the shape the fold lacks, and what it has too much, as bodies without the skins
    that chords leave. objectives: after each step. off: how far a place is off that nothing mends, unit
    lengths; 0 where none is.
    """

    features: list[Feature] = field(default_factory=list)
    covered: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    missed: Manifold = field(default_factory=Manifold)
    excess: Manifold = field(default_factory=Manifold)
    score: float = 0.0
    price: float = 0.0
    objectives: tuple[float, ...] = ()
    off: float = 0.0

    def at(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """(N,) whether points (N, 3) lie within the fold."""
        covered = np.zeros(len(points), bool)
        for feature in self.features:
            within = covers(feature.part, points)
            covered = covered | within if feature.added else covered & ~within
        return covered

    def distance(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """(N,) of the fold at points (N, 3); beyond edges a bound."""
        result = np.full(len(points), np.float32(10))
        for feature in self.features:
            own = feature.part.distance(points)
            result = np.minimum(result, own) if feature.added else np.maximum(result, -own)
        return result

    def first(self, count: int) -> FeatureTree:
        """The tree of the first features; its scores are not known."""
        return FeatureTree(self.features[:count])

    @property
    def objective(self) -> float:
        return self.score - self.price


class FeatureSearch:
    """The search for one shape. alpha: price of a feature. most: features. told: of each tree on the way."""

    def __init__(
        self,
        shape: Shape,
        samples: FitSamples,
        alpha: float,
        checkpoint: Checkpoint | None = None,
        most: int | None = None,
        told: Callable[[FeatureTree], None] | None = None,
    ) -> None:
        self.samples, self.alpha, self.checkpoint, self.told = samples, alpha, checkpoint, told
        self.most = min(most or _MOST, _MOST)
        self.limit = most or _MOST + _FOR_MENDING
        vertices, faces = shape.unit_mesh
        self.body = Manifold(Mesh(vertices.astype(np.float32), faces.astype(np.uint32)))
        self.frames = frames(vertices, faces)
        self.volume = float(self.body.volume())
        self.points = samples.points[::_EVERY]
        self.weights = _weights(samples)[::_EVERY]
        self.inside = samples.inside[::_EVERY]
        self._masks: dict[int, tuple[Candidate, NDArray[np.float32]]] = {}
        self._of_piece: dict[tuple[float, ...], list[Candidate]] = {}

    def run(self) -> FeatureTree | None:
        """The best tree; None where the surface encloses nothing to take sections of."""
        if self.body.is_empty() or self.volume <= 0:
            return None
        own = candidates(self.body, self.frames, holes=True)
        if not own:
            return None
        empty = FeatureTree(covered=np.zeros(len(self.inside), bool), missed=self.body)
        gains = self._gains(empty, own, True)
        order = np.argsort(-gains)[:_BASES]
        best: FeatureTree | None = None
        others = [candidate for candidate in own if not candidate.cuts]
        for index in order:
            if best is not None and (gains[index] < _RIVAL * gains[order[0]] or best.score > _PERFECT):
                break
            tree = self._grown(self.extended(empty, own[index], True), others, best)
            if best is None or tree.objective > best.objective:
                best = tree
        return replace(whole := mended(self, best), off=farthest(self, whole)) if best is not None else None

    def _grown(self, tree: FeatureTree, own: Sequence[Candidate], best: FeatureTree | None) -> FeatureTree:
        """Until nothing pays, or it is well behind where the best so far was after as many steps."""
        while len(tree.features) < self.most:
            if self.checkpoint is not None:
                self.checkpoint()
            step = self._step(tree, own)
            if step is None:
                break
            tree = step
            if self.told is not None:
                self.told(tree)
            if best is not None and self._behind(tree, best):
                break
        return tree

    @staticmethod
    def _behind(tree: FeatureTree, best: FeatureTree) -> bool:
        count = len(tree.objectives) - 1
        rival = best.objectives[min(count, len(best.objectives) - 1)]
        return count >= _PATIENT and tree.objective < rival - _BEHIND

    def _step(self, tree: FeatureTree, own: Sequence[Candidate]) -> FeatureTree | None:
        """The tree and what raises R most beyond its price."""
        missed = self._pieces(tree.missed, self.inside & ~tree.covered)
        excess = self._pieces(tree.excess, ~self.inside & tree.covered)
        adding = [*own, *(c for piece in missed for c in self.candidates_of(piece))]
        cutting = [c for piece in excess for c in self.candidates_of(piece)]
        best: tuple[float, Candidate, bool] | None = None
        for pool, added in ((adding, True), (cutting, False)):
            if not pool:
                continue
            gains = self._gains(tree, pool, added)
            index = int(gains.argmax())
            if best is None or gains[index] > best[0]:
                best = (float(gains[index]), pool[index], added)
        if best is None or best[0] <= 0:
            return None
        _, chosen, added = best
        return self.extended(tree, chosen, added, missed if added else excess)

    def extended(
        self, tree: FeatureTree, chosen: Candidate, added: bool, pieces: Sequence[Manifold] = ()
    ) -> FeatureTree:
        """The tree and a candidate, with the copies that stand for other pieces."""
        within = self._mask(chosen) > 0
        covered = tree.covered | within if added else tree.covered & ~within
        reached = self._score(covered)
        gain = reached - tree.score
        inner, outer = chosen.bodies
        instances = []
        for move in () if chosen.cuts else moves_between(inner, pieces, self.frames, self.body):
            copy = chosen.part.transformed(move)
            mask = covers(copy, self.points)
            more = covered | mask if added else covered & ~mask
            better = self._score(more)
            if better - reached < _COPY * gain:
                continue
            covered, reached, within = more, better, within | mask
            instances.append(move)
            inner, outer = (
                body + own.transform(_matrix(move))
                for body, own in zip((inner, outer), chosen.bodies, strict=True)
            )
        part = replace(chosen.part, instances=tuple(instances))
        opened = part if added else with_open_sides(part, self.samples.measure)
        if opened is not part:
            part, whole = opened, solid_of(opened, _CHORD)
            inner, outer = inner + whole, outer + whole
        feature = Feature(added, part, within, chosen.sides)
        if added:
            missed, excess = tree.missed - outer, tree.excess + (inner - self.body)
        else:
            missed, excess = tree.missed + (inner ^ self.body), tree.excess - outer
        for body in (missed, excess):
            body.num_tri()  # now, and not with every later step again
        cuts = (Feature(False, cut, within, 0) for cut in chosen.cuts)
        features = [*tree.features, feature, *cuts]
        price = tree.price + self._price(chosen.sides)
        steps = (*tree.objectives, reached - price)
        return FeatureTree(features, covered, missed, excess, reached, price, steps)

    def _price(self, sides: int) -> float:
        return self.alpha * (1 + _SIDE_PRICE * max(0, sides - _FREE_SIDES))

    def _pieces(self, residual: Manifold, wrong: NDArray[np.bool_]) -> list[Manifold]:
        """Connected pieces that may pay and are no skin, the largest first. wrong: the samples in them."""
        points, weight = self.points[wrong], self.weights[wrong]
        total = self.weights[self.inside].sum(axis=0)
        pieces = []
        for volume, piece in bodies(residual, _LEAST_PIECE * self.volume, _THIN):
            if piece.num_tri() > _COMPLEX:
                continue
            low, high = np.reshape(piece.bounding_box(), (2, 3))
            within = ((points > low) & (points < high)).all(axis=1)
            if float((weight[within].sum(axis=0) / total).mean()) > _HOPELESS * self.alpha:
                pieces.append((volume, piece if piece.num_tri() < _FINE else piece.simplify(_SKIN)))
        return [piece for _, piece in sorted(pieces, key=lambda p: -p[0])[:_PIECES]]

    def candidates_of(self, piece: Manifold) -> list[Candidate]:
        low, high = np.reshape(piece.bounding_box(), (2, 3))
        key = tuple(np.round([*low, *high, piece.volume()], 5).tolist())
        if key not in self._of_piece:
            if len(self._of_piece) >= _MOST_LOOKED:
                return []
            self._of_piece[key] = candidates(piece, [*self.frames, *self._own_frames(piece)], holes=True)
        return self._of_piece[key]

    def _own_frames(self, piece: Manifold) -> list[NDArray[np.float64]]:
        """The piece's own directions that are none of the whole's: of a small hole askew."""
        mesh = piece.to_mesh64()
        own = frames(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
        known = np.array([frame[:, 2] for frame in self.frames])
        return [frame for frame in own[:_OWN] if np.abs(known @ frame[:, 2]).max() < _ASKEW]

    def _mask(self, candidate: Candidate) -> NDArray[np.float32]:
        """(N,) 1 at the samples within."""
        known = self._masks.get(id(candidate))
        if known is None:
            within = covers(candidate.part, self.points)
            for cut in candidate.cuts:
                within &= ~covers(cut, self.points)
            known = candidate, within.astype(np.float32)
            self._masks[id(candidate)] = known
        return known[1]

    def _gains(self, tree: FeatureTree, pool: Sequence[Candidate], added: bool) -> NDArray[np.float64]:
        """(C,) by how much each raises R beyond its price."""
        inside, outside = self.weights * self.inside[:, None], self.weights * ~self.inside[:, None]
        both = (inside * tree.covered[:, None]).sum(axis=0)
        either = inside.sum(axis=0) + (outside * tree.covered[:, None]).sum(axis=0)
        changes = ~tree.covered if added else tree.covered
        columns = (np.hstack([inside, outside]) * changes[:, None]).astype(np.float32)
        sign = 1.0 if added else -1.0
        scores = []
        for start in range(0, len(pool), _BATCH):
            masks = np.stack([self._mask(c) for c in pool[start : start + _BATCH]])
            change = sign * (masks @ columns)
            ratio = (both + change[:, :2]) / np.maximum(either + change[:, 2:], 1e-9)
            scores.append(ratio.mean(axis=1))
        price = np.array([self._price(c.sides) for c in pool])
        return np.concatenate(scores) - tree.score - price

    def scored(self, tree: FeatureTree) -> FeatureTree:
        """The tree with its score and price."""
        price = sum(self._price(feature.sides) for feature in tree.features)
        return replace(tree, score=self._score(tree.at(self.points)), price=price)

    def _score(self, covered: NDArray[np.bool_]) -> float:
        both = self.weights[covered & self.inside].sum(axis=0)
        either = self.weights[covered | self.inside].sum(axis=0)
        return float((both / np.maximum(either, 1e-9)).mean())


def _weights(samples: FitSamples) -> NDArray[np.float64]:
    """(N, 2): of the samples near the surface, and of the others."""
    weights = np.zeros((len(samples.points), 2))
    weights[: samples.near, 0] = samples.weight[: samples.near]
    weights[samples.near :, 1] = samples.weight[samples.near :]
    return weights


def _matrix(move: Similarity) -> NDArray[np.float64]:
    return np.column_stack([rotation_matrix(move.rotation), move.translation])


def covers(part: Part, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie within the part or one of its copies."""
    result = np.zeros(len(points), bool)
    for copy in part.copies:
        low, high = copy.bounds()
        near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
        if len(near):
            local = (points[near] - copy.translation) @ rotation_matrix(copy.rotation)
            result[near] |= copy.field(local) < 0
    return result
