"""A candidate with its copies, and its mirror image where that is another solid: what one price brings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.open_sides import with_open_sides
from partwright.approximation.sketches.repeats import moves_between, planes_between, shifts_between
from partwright.approximation.sketches.teeth import drawn_corners
from partwright.assembly import Part, Similarity
from partwright.assembly.bounding_box import moved_boxes
from partwright.assembly.motion import Motion
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion
from partwright.meshing.csg import solid_of
from partwright.superfrusta.feature_steps import (
    Feature,
    FeatureTree,
    Step,
    as_move,
    covers,
    image_of,
    within_box,
)
from partwright.superfrusta.feature_symmetry import reflected, reflection

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

Points = NDArray[np.float64]

_COPY = 0.4  # of what the first gains, that a copy has to
_AROUND = 5e-3  # unit lengths: from a part to points of the surface that are its own
_EXACT = 1e-4  # unit lengths: moves whose means differ by less are as good
_BY_CHANCE = 1.0  # roots of the number of samples, by which a copy may have fewer, and still be one
_LEAST_COPY = 0.3
_FEW = 20  # samples, of which chance has too many or too few
_POINTS = 200
_COMPOSED = 48  # turns after reflections, at most
_DIGITS = 9  # of shifts that are told apart
_APART = 8e-3  # unit lengths: shifts that differ by less lead to the same place
_WAYS = 500  # that a part is tried at beyond where it is seen
_SHARED = 0.5  # of the samples in a mirror image, that its part or another copy may hold already
_ROUNDING = 1e-9  # unit lengths, of boxes: what they may hold is looked at again
_CHORD = 1e-3  # unit lengths: how far chords of a cut with moved sides may be off


def with_copies(
    search: FeatureSearch,
    tree: FeatureTree,
    chosen: Candidate,
    added: bool,
    pieces: Sequence[Manifold] = (),
    others: Sequence[Candidate] = (),
) -> Step:
    """The candidate with copies where the whole's symmetries, pieces that are alike or other candidates have
    it again."""
    within, opened = search.mask(chosen) > 0, search.opened(chosen)
    if chosen.cuts:
        covered = tree.behind(within)
    else:
        covered = tree.covered | within if added else tree.covered & ~within
    wrong = search.inside & ~tree.covered if added else ~search.inside & tree.covered
    count_of_hits = float(within[wrong].sum())
    share = max(_COPY - _BY_CHANCE / math.sqrt(max(count_of_hits, 1.0)), _LEAST_COPY)
    reached = search.score_of(covered)
    least = share * (reached - tree.score)
    is_small = count_of_hits < _FEW
    few, hits = search.points[wrong & ~within], 0.0 if is_small else share * count_of_hits
    left = np.ones(len(few), bool)

    def taken(part: Part) -> float:
        """What volume a part takes of what is missed, or too much."""
        return float((solid_of(part, _CHORD) ^ (tree.missed if added else tree.excess)).volume())

    least_taken = share * taken(chosen.part) if is_small else 0.0

    def is_new(hit: NDArray[np.bool_]) -> bool:
        """Whether no other is there. hit: those of `few` within."""
        return float((hit & left).sum()) > hits

    def gained(whole: Part, mask: NDArray[np.bool_], hit: NDArray[np.bool_]) -> bool:
        """Whether further copies gain enough, which they then do: of what is small, by volume, and lose
        nothing. mask: samples within."""
        nonlocal covered, reached, within, left
        more = covered | mask if added else covered & ~mask
        better, count = search.score_of(more), len(whole.copies)
        if better - reached < (0.0 if is_small else least * count):
            return False
        if is_small and taken(whole) < least_taken * count:
            return False
        covered, reached, within, left = more, better, within | mask, left & ~hit
        return True

    def joined(copy: Part, hit: NDArray[np.bool_]) -> bool:
        return is_new(hit) and gained(copy, covers(copy, search.points), hit)

    def is_image(whole: Part) -> bool:
        """Whether a mirror image with its copies joined, which most of it may not have been before."""
        hit = covers(whole, few)
        if not is_new(hit):
            return False
        mask = covers(whole, search.points)
        return bool((mask & within).sum() < _SHARED * mask.sum()) and gained(whole, mask, hit)

    part, image = chosen.part, None
    if not chosen.cuts:  # of which there is but one
        inner, _ = chosen.bodies
        planes = [*search.mirrors, *(reflection(*plane) for plane in planes_between(inner, pieces))]
        flipped = image_of(part, Similarity())
        across = [*planes, *_turned(search.mirrors, search.turns)]
        images = ((plane, as_move(part, flipped.transformed(plane))) for plane in across)
        flips = {move: Motion(plane, True) for plane, move in images if move is not None}
        moves = [*search.turns, *flips]
        moves += moves_between(inner, pieces, search.frames, search.body)
        moves += shifts_between(chosen, others)
        moves += _shifts(part, search.turns, search.mirrors)
        near = ((move, part.transformed(move)) for move in _reaching(part, moves, few, hits))
        may_pay = {move: (copy, hit) for move, copy in near if (hit := covers(copy, few)).sum() > hits}
        ordered = nearest_first(search, part, list(may_pay), flips if chosen.beyond else {})
        kept = [move for move in ordered if joined(*may_pay[move])]
        rest = few[left]
        ways = _lattice(part, kept) if len(rest) > hits else ()
        corners = ((move, part.transformed(move)) for move in _reaching(part, ways, rest, hits))
        kept += [move for move, copy in corners if joined(copy, covers(copy, few))]
        part = replace(part, instances=tuple(kept))
        flipped = image_of(part, Similarity()) if kept else flipped
        wholes = ((plane, flipped.transformed(plane)) for plane in planes)
        image = next((plane for plane, one in wholes if is_image(one)), None)
    objective = reached - tree.price - search.price(chosen.sides)
    return Step(chosen, added, part, covered, within, opened, reached, objective, image)


def _reaching(
    part: Part, moves: Sequence[Similarity], points: NDArray[np.float32], most: float
) -> list[Similarity]:
    """Those that take the part to where its box holds more than so many points (N, 3)."""
    if not len(moves):
        return []
    boxes = moved_boxes(part, moves) + np.array([[-_ROUNDING], [_ROUNDING]])
    return [m for m, box in zip(moves, boxes, strict=True) if within_box(points, *box).sum() > most]


def _turned(mirrors: Sequence[Similarity], turns: Sequence[Similarity]) -> list[Similarity]:
    """Reflections and then turns, where there are not very many: a corner of a block is across its middle
    from another, where neither a turn nor a reflection alone leads."""
    few = len(turns) * len(mirrors) <= _COMPOSED
    return [turn @ mirror for turn in turns for mirror in mirrors] if few else []


def _lattice(part: Part, moves: Sequence[Similarity]) -> list[Similarity]:
    """Shifts by the sum or difference of two of the ways that a part's middle is moved, where they lead to
    another place: of four holes that one piece holds, two along the edges are seen, and none across. Of very
    many places those to which most of the sums lead, which lie amid the others."""
    middle = np.array(part.translation)
    known = np.array([np.zeros(3), *(move(middle) - middle for move in moves)])
    first, second = (known[k] for k in np.triu_indices(len(known), 1))
    sums = np.concatenate([first + second, first - second, second - first])
    far = cKDTree(known).query(sums)[0] > _APART
    ways, often = np.unique(np.round(sums[far], _DIGITS) + 0.0, axis=0, return_counts=True)
    _, first, place = np.unique(
        np.rint(ways / _APART).astype(int), axis=0, return_index=True, return_inverse=True
    )
    count = np.bincount(place.ravel(), often)
    ways = ways[np.sort(first[np.argsort(-count, kind="stable")[:_WAYS]])]
    return [Similarity(translation=(x, y, z)) for x, y, z in ways.tolist()]


def _shifts(part: Part, turns: Sequence[Similarity], mirrors: Sequence[Similarity]) -> list[Similarity]:
    """To where symmetries take the middle of a part, which itself may not be turned: a foot with a hole."""
    middle = np.array(part.translation)
    places = [*(move(middle) for move in turns), *(reflected(move, middle) for move in mirrors)]
    ways = np.unique(np.round(np.reshape(places, (-1, 3)) - middle, _DIGITS) + 0.0, axis=0)
    return [
        Similarity(translation=(x, y, z)) for x, y, z in ways.tolist() if abs(x) + abs(y) + abs(z) > _EXACT
    ]


def nearest_first(
    search: FeatureSearch, part: Part, moves: Sequence[Similarity], flips: Mapping[Similarity, Motion]
) -> list[Similarity]:
    """Those first that take the surface around the part to the surface most exactly; symmetries of a whole
    that is not quite symmetric, and middles of pieces with skins, are a little off. flips: the reflections
    that some stand for, which may turn the part over for it: the surface is at one end alone of what is cut
    beyond the shape."""
    if len(moves) < 2:
        return list(moves)
    surface = search.samples.surface
    around = surface[np.abs(part.distance(surface)) < _AROUND]
    points = around[:: max(1, len(around) // _POINTS)].astype(np.float64)
    if not len(points):
        return list(moves)

    motions = [motion for move in moves for motion in (move, flips.get(move, move))]
    images = np.concatenate([motion(points) for motion in motions]).astype(np.float32)
    away = np.minimum(search.samples.away(images, _AROUND), _AROUND).reshape(len(moves), 2, -1)
    own, image = np.round(away.mean(axis=2) / _EXACT).T
    return [moves[i] for i in np.lexsort([own, np.minimum(own, image)])]


class StepBodies:
    """What a step adds to a search's shape or cuts from it, made once for the same candidate with the same
    copies: trees that are replayed with another step have the rest again."""

    def __init__(self, search: FeatureSearch) -> None:
        self._search = search
        self._known: dict[tuple[object, ...], tuple[Step, tuple[Part, Manifold, Manifold]]] = {}

    def __call__(self, step: Step) -> tuple[Part, Manifold, Manifold]:
        """The part, its sides in the open further out where it is cut; the body around it; and of the body
        within it what is not the shape's where it is added, and what is where it is cut."""
        key = id(step.chosen), step.added, step.part.instances, step.image
        if key not in self._known:
            self._known[key] = step, self._made(step)
        return self._known[key][1]

    def _made(self, step: Step) -> tuple[Part, Manifold, Manifold]:
        search, chosen, image = self._search, step.chosen, step.image
        part = step.part if step.added else with_open_sides(step.part, search.samples.measure, search.reach)
        inner, outer = chosen.bodies
        moves = [_matrix(move) for move in step.part.instances]
        if part is not step.part:
            whole = solid_of(replace(part, instances=()), _CHORD)
            inner, outer = inner + whole, outer + whole
        inner, outer = (sum((body.transform(move) for move in moves), body) for body in (inner, outer))
        if image is not None:
            flip = _matrix(image) * [-1.0, 1.0, 1.0, 1.0]
            inner, outer = (body + body.transform(flip) for body in (inner, outer))
        return part, outer, inner - search.body if step.added else inner ^ search.body


def joined_by(search: FeatureSearch, tree: FeatureTree, step: Step) -> FeatureTree:
    """The tree and a candidate with its copies; one that comes with cuts before all else, of which these
    then take nothing."""
    return replayed(search, [step, *tree.steps]) if step.chosen.cuts else _followed_by(search, tree, step)


def _followed_by(search: FeatureSearch, tree: FeatureTree, step: Step) -> FeatureTree:
    part, outer, own = search.step_bodies(step)
    if step.added:
        missed, excess = tree.missed - outer, tree.excess + own
        if (tree.covered & step.opened).any():
            gone = sum((solid_of(cut, _CHORD) for cut in step.chosen.cuts), Manifold())
            missed, excess = missed + (gone ^ search.body), excess - gone
    else:
        missed, excess = tree.missed + own, tree.excess - outer
    sides = step.chosen.sides - (_hole_corners(step.part) - _hole_corners(part))
    feature = Feature(step.added, part, step.within, sides, step.image)
    cuts = (Feature(False, cut, step.opened, 0) for cut in step.chosen.cuts)
    price = tree.price + search.price(sides)
    features, steps = [*tree.features, feature, *cuts], (*tree.steps, step)
    return FeatureTree(features, step.covered, missed, excess, step.score, price, steps)


def _hole_corners(part: Part) -> int:
    """Of the holes of a profile that is extruded."""
    return drawn_corners(part.field.profile.holes) if isinstance(part.field, Extrusion) else 0


def replayed(search: FeatureSearch, steps: Sequence[Step]) -> FeatureTree:
    """The tree of steps, whatever they followed before."""
    result = search.empty
    for step in steps:
        covered = step.after(result.covered)
        score = search.score_of(covered)
        objective = score - result.price - search.price(step.chosen.sides)
        result = _followed_by(
            search, result, replace(step, covered=covered, score=score, objective=objective)
        )
    return result


def _matrix(move: Similarity) -> NDArray[np.float64]:
    return np.column_stack([rotation_matrix(move.rotation), move.translation])
