"""Chips: pieces that a tree of features leaves in the air beside the body, where the shape has nothing, and
pieces that a hair's breadth cuts off from it.

Two features meet that way whose walls were read a little apart. One of the walls moves by as little as will
do: of a cut over the chip, of what was added back from it, or over the gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from partwright.approximation.sketches.bodies import bodies
from partwright.assembly import Assembly, Part
from partwright.assembly.motion import Motion
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Extrusion
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import CHORD, Solid, far_places
from partwright.superfrusta.feature_steps import Feature, FeatureTree, covers
from partwright.superfrusta.moved_faces import faces_of, with_corners_moved, without_corners

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

Floats = NDArray[np.float64]

_CRUMB = 1e-7  # of the volume: a piece that is smaller is rounding
_SMALL = 0.02  # of the volume, that a chip is at most
_OWN = 0.5  # of a piece that lies in the shape: it is cut off there; else it is in the air
_BESIDE = 3e-3  # unit lengths: a part is one of those that leave a chip if it is as near to it
_FURTHEST = 0.018  # unit lengths, by which a wall may move: 1 % of the longest side
_CLEAR = 5e-4  # unit lengths beyond a chip: more than plain numbers move a wall by
_STEPS = (1e-3, 2e-3, 5e-3, 0.01)  # unit lengths, by which a wall moves over a gap
_BENDS = (2e-3, 4e-3, 8e-3, _FURTHEST)  # unit lengths, by which a corner of a cut's outline moves
_DROPPED = (1, 2, 3)  # corners of it that go
_TOUCHES = 2e-4  # unit lengths: what is as near beyond an outline lies on it
_LOSS = 5e-4  # of R, that it may cost
_FURTHER = 2e-3  # unit lengths, by which what is far off may be so still more
_MOST = 8  # chips
_TRIES = 12  # walls that are moved for one


@dataclass(frozen=True, eq=False)
class _Chip:
    """A piece beside the largest. corners: (N, 3). floats: whether it lies in the air."""

    corners: Floats
    body: Manifold
    volume: float
    floats: bool

    @property
    def key(self) -> tuple[float, ...]:
        return tuple(np.round([*self.corners.min(axis=0), *self.corners.max(axis=0)], 3).tolist())


def without_chips(
    search: FeatureSearch, tree: FeatureTree, made: Callable[[FeatureTree], Assembly]
) -> FeatureTree:
    """The tree with walls moved a little so that no chips are left, as far as that goes.

    made: as of `with_freeform`. A piece that the shape has is none. What is missed and what is too much are
    left as they were.
    """
    own = _pieces(search.body)
    whole = solid_of(made(tree), CHORD)
    given_up: set[tuple[float, ...]] = set()
    for _ in range(_MOST):
        chips = [chip for chip in _chips(search, whole, own) if chip.key not in given_up]
        if not chips:
            break
        better = _without(search, tree, whole, chips[0], made)
        if better is None:
            given_up.add(chips[0].key)
        else:
            tree, whole = better
    return tree


def _pieces(body: Manifold) -> list[tuple[float, Manifold]]:
    """The largest first."""
    return sorted(bodies(body, _CRUMB * body.volume(), 0.0), key=lambda piece: -piece[0])


def _chips(search: FeatureSearch, whole: Manifold, own: Sequence[tuple[float, Manifold]]) -> list[_Chip]:
    """Of a body that has more pieces than the shape, those that are none of its own."""
    found = []
    pieces = _pieces(whole)
    if len(pieces) <= 1 or len(pieces) <= len(own):
        return []
    for volume, piece in pieces[1:]:
        inside = float((piece ^ search.body).volume())
        if volume > _SMALL * search.volume or any(
            float((piece ^ other).volume()) > _OWN * most for most, other in own
        ):
            continue
        corners = np.asarray(piece.to_mesh64().vert_properties)[:, :3].astype(np.float64)
        found.append(_Chip(corners, piece, volume, inside < _OWN * volume))
    return found


def _without(
    search: FeatureSearch,
    tree: FeatureTree,
    whole: Manifold,
    chip: _Chip,
    made: Callable[[FeatureTree], Assembly],
) -> tuple[FeatureTree, Manifold] | None:
    """The tree with the wall moved that costs least, and its body; None where none helps."""
    before = len(_pieces(whole))
    tries = sorted(_tries(search, tree, chip), key=lambda one: -one.score)[:_TRIES]
    for other in tries:
        if other.score < tree.score - _LOSS:
            break
        assembly = made(other)
        body = solid_of(assembly, CHORD)
        if _is_gone(chip, _pieces(body), before) and not _is_further_off(search, tree, assembly):
            return other, body
    return None


def _is_gone(chip: _Chip, pieces: Sequence[tuple[float, Manifold]], before: int) -> bool:
    """Whether there are fewer pieces, and of those beside the largest none is most of the chip."""
    return len(pieces) < before and not any(
        float((piece ^ chip.body).volume()) > _OWN * min(volume, chip.volume) for volume, piece in pieces[1:]
    )


def _is_further_off(search: FeatureSearch, tree: FeatureTree, assembly: Assembly) -> bool:
    """Whether what is made of another tree is further off than this one is known to be."""
    shape = Solid(search.body, search.samples.measure)
    places = far_places(shape, Solid.of(assembly))
    return any(place.off > tree.off + _FURTHER for place in places)


def _tries(search: FeatureSearch, tree: FeatureTree, chip: _Chip) -> Iterator[FeatureTree]:
    """Trees with one wall moved: over the chip where it floats, and over the gap where it does not."""
    for k, feature in enumerate(tree.features):
        if feature.freeform:
            continue
        for seen in _seen_from(feature, chip.corners):
            if np.abs(feature.part.field(seen.astype(np.float32))).min() > _BESIDE:
                continue
            moved = _moved(feature, seen, chip.floats)
            for part in chain(moved, _redrawn(feature, seen) if chip.floats else ()):
                changed = replace(feature, part=part, covers=covers(part, search.points))
                features = [*tree.features[:k], changed, *tree.features[k + 1 :]]
                other = replace(tree, features=features, steps=())
                covered = other.at(search.points)
                yield replace(other, covered=covered, score=search.score_of(covered))


def _seen_from(feature: Feature, points: Floats) -> Iterator[Floats]:
    """Points (N, 3) in the frame of each copy of a feature's part."""
    sights = [points]
    if feature.image is not None:
        sights.append(Motion(feature.image, True).inverse()(points))
    for some in sights:
        for copy in feature.part.copies:
            yield (some - copy.translation) @ rotation_matrix(copy.rotation)


def _moved(feature: Feature, seen: Floats, floats: bool) -> Iterator[Part]:
    """The part with one face moved: of a cut out over a chip in the air, of what is added in before it. Where
    a chip is cut off the other way, a little and a little more."""
    for face in faces_of(feature.part):
        beyond = face.beyond(seen)
        if floats:
            needed = float(beyond.max()) if not feature.added else -float(beyond.min())
            steps: Sequence[float] = (needed + _CLEAR,) if -_CLEAR < needed < _FURTHEST else ()
        else:
            steps = _STEPS if np.abs(beyond).min() <= _BESIDE else ()
        outwards = floats is not feature.added
        for step in steps:
            with suppress(ParameterError):
                yield face.moved(step if outwards else -step)


def _redrawn(feature: Feature, seen: Floats) -> Iterator[Part]:
    """A cut whose outline takes in a chip in the air: without corners about which it goes around that, or
    with corners further out, as little as will do, one or all that are near."""
    part, points = feature.part, seen.astype(np.float32)
    if feature.added or not isinstance(part.field, Extrusion) or part.field.taper:
        return
    for loop, corners in enumerate(part.field.profile.loops):
        off = np.linalg.norm(np.array(corners)[:, None, :2] - seen[:, :2], axis=2).min(axis=1)
        near = np.flatnonzero(off < _FURTHEST).tolist()
        for ways in (
            *([partial(without_corners, part, loop, k, count)] for k in near for count in _DROPPED),
            *(
                [partial(with_corners_moved, part, loop, some, step) for step in _BENDS]
                for some in (*([k] for k in near), near)
            ),
        ):
            for way in ways:
                with suppress(ParameterError):
                    other = way()
                    if float(other.field(points).max()) < _TOUCHES:
                        yield other
                        break
