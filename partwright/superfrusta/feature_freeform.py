"""What no feature explains, kept as freeform: where a tree is far off, it takes the shape's own form.

A part that ends there goes on, where that is enough. Else around such a place the shape, or the space beside
it, is cut along one of the directions of the whole. Where it is one extrusion there, that is one more
feature. Else a few extrusions follow it: worse to read than a
feature, but no further off than is allowed. They are called `freeform_1` and so on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from partwright.approximation.sketches.terraces import terraces
from partwright.assembly import Assembly, Part, Similarity
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import (
    CHORD,
    NEARLY,
    Place,
    Solid,
    far_places,
    loose_places,
    reach,
)
from partwright.superfrusta.feature_lengthening import lengthened
from partwright.superfrusta.feature_mending import FAR
from partwright.superfrusta.feature_steps import Feature, FeatureTree, as_move, covers, image_of, within_box
from partwright.superfrusta.feature_symmetry import reflected
from partwright.superfrusta.feature_thinning import reaches

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

_MOST = 4  # extrusions of one place
_PLACES = 30
_DEARER = 2.0  # times the price of a feature, that one costs: it says nothing of how it would be drawn
_TOLERANCES = (0.9, 0.5)  # of `FAR`
_EXACT = 0.1  # of `FAR`: what is as near to the shape is a feature
_AROUND = 0.02  # unit lengths, by which what is drawn is larger than the place
_BESIDE = 0.07  # the same of a feature that is cut, whose walls are nearer than what is far off
_LOOKED = 0.1  # unit lengths around a place that is looked at again
_BETTER = 0.9  # of what a place was off, that it may be when mended
_LOSS = 3e-3  # of R, that mending one place may cost
_JOINED = 0.1  # of the share of the volume that floats, which joining it may cost of R besides


@dataclass(frozen=True)
class _Mended:
    """A tree with a place mended, as a solid, by parts. off: what that place still is."""

    tree: FeatureTree
    solid: Solid
    parts: list[Part]
    off: float

    @property
    def rank(self) -> tuple[float, float]:
        """Less is better: few parts where the place is near enough, else the nearest."""
        if self.off < NEARLY * FAR:
            return len(self.parts), -self.tree.score
        return _MOST + 1, self.off


def with_freeform(
    search: FeatureSearch,
    tree: FeatureTree,
    made: Callable[[FeatureTree], Assembly],
    most: int | None = None,
) -> FeatureTree:
    """The tree, and what brings its surface to within `FAR` of the shape's, the farthest place first; and
    what joins pieces that hardly float, where the shape has fewer bodies.

    made: what becomes of a tree, in the unit frame, which is what is measured: ends of cuts are open there,
    and cuts belong to what they meet. most: features of the result. What is missed and too much are left as
    they were.
    """
    shape = Solid(search.body, search.samples.measure)
    covered = tree.at(search.points)
    tree = replace(tree, covered=covered, score=search.score_of(covered))
    given_up: list[Place] = []
    for _ in range(_PLACES):
        other = Solid.of(made(tree))
        places = [
            place
            for place in (*far_places(shape, other), *loose_places(shape, other))
            if not _among(place, given_up)
        ]
        left = _MOST if most is None else min(_MOST, most - len(tree.features))
        if not places or left < 1:
            break
        start = _Mended(tree, other, [], places[0].off)
        # A part that goes on is no further one, so nothing that adds parts comes before it.
        tries = list(_longer(search, shape, start, places, made)) or _tries(
            search, shape, start, places, left
        )
        best = min(tries, key=lambda one: one.rank, default=None)
        if best is None:
            given_up.append(places[0])
        elif not best.parts:
            tree = best.tree
        else:
            tree = _with_copies(search, shape, start, best, places).tree
    return replace(tree, off=far_off(search, made(tree)))


def far_off(search: FeatureSearch, whole: Assembly) -> float:
    """How far an assembly in the unit frame is off where it is far off, unit lengths; else 0."""
    places = far_places(Solid(search.body, search.samples.measure), Solid.of(whole))
    return max((place.off for place in places), default=0.0)


def most_explained(search: FeatureSearch, whole: Assembly, covered: NDArray[np.bool_]) -> float:
    """R of an assembly in the unit frame if freeform brought all that it lacks, and all that it has too much,
    near places that are far off: what comes of it is hardly ever more, and this is quickly known.

    covered: (N,) the samples within the assembly.
    """
    shape, other = Solid(search.body, search.samples.measure), Solid.of(whole)
    for place in (*far_places(shape, other), *loose_places(shape, other)):
        low, high = place.box
        near = within_box(search.points, low - _BESIDE, high + _BESIDE)
        covered = np.where(near & (search.inside == place.lacks), place.lacks, covered)
    return search.score_of(covered)


def _longer(
    search: FeatureSearch,
    shape: Solid,
    start: _Mended,
    places: Sequence[Place],
    made: Callable[[FeatureTree], Assembly],
) -> Iterator[_Mended]:
    """With a part that ends at the first of places going on, where that brings it near enough: it is no
    further part."""
    place, *others = places
    for k, feature in enumerate(start.tree.features):
        if feature.added is not place.lacks or feature.image is not None or feature.freeform:
            continue
        if not reaches(feature, place.box):
            continue
        for part in lengthened(feature.part, feature.added, search.samples.measure):
            if part.distance(place.points.astype(np.float32)).max() > NEARLY * FAR:
                continue
            features = list(start.tree.features)
            features[k] = replace(feature, part=part, covers=covers(part, search.points))
            tree = replace(start.tree, features=features)
            covered = tree.at(search.points)
            tree = replace(tree, covered=covered, score=search.score_of(covered))
            solid = Solid.of(made(tree))
            off = _left(shape, solid, place, others)
            fewer = start.solid.count - solid.count
            near = off < NEARLY * FAR and fewer >= (1 if place.gap else 0)
            if near and tree.score >= start.tree.score - _LOSS:
                yield _Mended(tree, solid, [], off)


def _tries(
    search: FeatureSearch, shape: Solid, start: _Mended, places: Sequence[Place], most: int
) -> Iterator[_Mended]:
    """Ways to mend the first of places, each better than it is: by one feature that is as exact as others
    are, else by what follows the shape, finer where no coarse one brings it near enough."""
    place, *others = places
    enough = False
    for tolerance, feature in ((_EXACT, True), *((one, False) for one in _TOLERANCES)):
        for frame in search.frames if not enough else ():
            beside = _BESIDE if feature and not place.lacks else _AROUND
            along = tolerance * FAR / 2 if feature else _AROUND
            local = _around(place, shape.body, frame, beside, along)
            parts = terraces(local, frame, tolerance * FAR, 1 if feature else most, place.points)
            mended = _joined(search, shape, start, parts, place, others, not feature) if parts else None
            if mended is not None and not (feature and mended.off >= NEARLY * FAR):
                yield mended
                enough = enough or mended.off < NEARLY * FAR


def _around(
    place: Place, body: Manifold, frame: NDArray[np.float64], beside: float, along: float
) -> Manifold:
    """What there is of a body around a place, or what there is beside it where it has too much."""
    seen, room = place.points @ frame, np.array([beside, beside, along])
    low, high = seen.min(axis=0) - room, seen.max(axis=0) + room
    box = Manifold.cube((high - low).tolist()).translate(low.tolist())
    box = box.transform(np.column_stack([frame, np.zeros(3)]))
    return body ^ box if place.lacks else box - body


def _joined(
    search: FeatureSearch,
    shape: Solid,
    start: _Mended,
    parts: list[Part],
    place: Place,
    others: Sequence[Place],
    freeform: bool,
) -> _Mended | None:
    """With parts added, or cut, where that makes a place better and leaves the body whole. others: places
    that are as far off as they were."""
    tree, body = start.tree, start.solid.body
    features = [
        Feature(place.lacks, part, covers(part, search.points), 0, freeform=freeform) for part in parts
    ]
    covered = tree.covered
    for feature in features:
        covered = covered | feature.covers if place.lacks else covered & ~feature.covers
    score = search.score_of(covered)
    if score < tree.score - _LOSS - _JOINED * place.floats:
        return None
    price = tree.price + (_DEARER if freeform else 1.0) * search.alpha * len(parts)
    tree = replace(tree, features=[*tree.features, *features], covered=covered, score=score, price=price)
    for part in parts:
        whole = solid_of(part, CHORD)
        body = body + whole if place.lacks else body - whole

    def distance(points: NDArray[np.float32]) -> NDArray[np.float32]:
        result = start.solid.distance(points)
        for part in parts:
            own = part.distance(points)
            result = np.minimum(result, own) if place.lacks else np.maximum(result, -own)
        return result

    solid = Solid(body, distance)
    off = _left(shape, solid, place, others)
    if off >= (NEARLY * FAR if place.gap else _BETTER * place.off):
        return None
    fewer = start.solid.count - solid.count
    return _Mended(tree, solid, parts, off) if fewer >= (1 if place.gap else 0) else None


def _left(shape: Solid, solid: Solid, place: Place, others: Sequence[Place]) -> float:
    """How far a place is off, or what is around it, if that is further off than the other places there."""
    around = place.box + np.array([[-_LOOKED], [_LOOKED]])
    off = reach(shape, solid, around)
    known = (
        other.off for other in others if (other.box[0] < around[1]).all() and (other.box[1] > around[0]).all()
    )
    if off > max(known, default=0.0) + CHORD:
        return off
    return reach(shape, solid, place.box + np.array([[-_AROUND], [_AROUND]]))


def _with_copies(
    search: FeatureSearch, shape: Solid, start: _Mended, first: _Mended, places: Sequence[Place]
) -> _Mended:
    """With copies where symmetries of the whole take the first of the places to another."""
    others = [place for place in places[1:] if place.lacks is places[0].lacks]
    kept: list[list[Similarity]] = []
    best = first
    for moves, middle in _symmetric(search, first.parts, places[0].box.mean(axis=0)):
        other = next((place for place in others if _within(middle, place)), None)
        if other is None:
            continue
        images = [part.transformed(move) for part, move in zip(first.parts, moves, strict=True)]
        rest = [place for place in places[1:] if place is not other]
        more = _joined(search, shape, best, images, other, rest, first.tree.features[-1].freeform)
        if more is not None and more.off < NEARLY * FAR:
            others.remove(other)
            kept.append(moves)
            best = more
    features = [
        replace(feature, part=replace(feature.part, instances=tuple(moves)))
        for feature, *moves in zip(first.tree.features[len(start.tree.features) :], *kept, strict=True)
    ]
    tree = replace(best.tree, features=[*start.tree.features, *features], price=first.tree.price)
    return replace(best, tree=tree)


def _symmetric(
    search: FeatureSearch, parts: Sequence[Part], point: NDArray[np.float64]
) -> Iterator[tuple[list[Similarity], NDArray[np.float64]]]:
    """For each symmetry of the whole the moves that make it of parts, and of a point (3,)."""
    for turn in search.turns:
        yield [turn] * len(parts), turn(point)
    for plane in search.mirrors:
        moves = [move for part in parts if (move := as_move(part, image_of(part, plane))) is not None]
        if len(moves) == len(parts):
            yield moves, reflected(plane, point[None])[0]


def _within(point: NDArray[np.float64], place: Place) -> bool:
    low, high = place.box
    return bool(((point > low - _AROUND) & (point < high + _AROUND)).all())


def _among(place: Place, others: Sequence[Place]) -> bool:
    return any(other.lacks is place.lacks and _within(place.box.mean(axis=0), other) for other in others)
