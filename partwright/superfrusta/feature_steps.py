"""The steps of a tree of features: parts that are added or cut, each with its copies and its mirror image."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from manifold3d import Manifold
from numpy.typing import ArrayLike, NDArray

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.ends import with_open_ends
from partwright.assembly import Part, Similarity
from partwright.assembly.motion import Motion
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion, Field
from partwright.fields.profile import is_same_loop
from partwright.meshing.csg import solid_of

_CHORD = 1e-3  # unit lengths: how far chords of a fold may be off
_SAME = 1e-5  # of a profile's size: corners that differ by less are the same


@dataclass(frozen=True)
class Feature:
    """One step of the tree. covers: (N,) the samples within any copy.

    image: where the part and all its copies are there as a mirror image, too: what comes after the mirror in
    the plane x = 0. freeform: whether it is no feature that was drawn, but the shape's own form.
    """

    added: bool
    part: Part
    covers: NDArray[np.bool_]
    sides: int
    image: Similarity | None = None
    freeform: bool = False

    @property
    def parts(self) -> tuple[Part, ...]:
        """The part, and its mirror image where there is one."""
        return (self.part,) if self.image is None else (self.part, image_of(self.part, self.image))


@dataclass(frozen=True)
class Step:
    """A candidate with its copies.

    covered: (N,) the samples within the tree with them; within: those within them; opened: those that cuts
    which the candidate comes with take away, also from what was there before. score: R of that tree.
    image: as of a feature.
    """

    chosen: Candidate
    added: bool
    part: Part
    covered: NDArray[np.bool_]
    within: NDArray[np.bool_]
    opened: NDArray[np.bool_]
    score: float
    objective: float
    image: Similarity | None = None

    def after(self, covered: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(N,) the samples covered when the step follows what covers such."""
        return covered & ~self.opened | self.within if self.added else covered & ~self.within


@dataclass
class FeatureTree:
    """Features in order, and the samples (N,) within their fold.

    missed, excess: what of the shape the fold lacks, and what it has too much, as bodies without the skins
    that chords leave. steps: that led to it, where they are known. off: how far a place is off that nothing
    mends, unit lengths; 0 where none is.
    """

    features: list[Feature] = field(default_factory=list)
    covered: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    missed: Manifold = field(default_factory=Manifold)
    excess: Manifold = field(default_factory=Manifold)
    score: float = 0.0
    price: float = 0.0
    steps: tuple[Step, ...] = ()
    off: float = 0.0

    def behind(self, first: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(N,) the samples covered where all steps follow what covers such (N,)."""
        for step in self.steps:
            first = step.after(first)
        return first

    def at(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """(N,) whether points (N, 3) lie within the fold."""
        steps = ((f.added, covers(part, points)) for f in self.features for part in f.parts)
        return fold(steps, len(points))

    def distance(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """(N,) of the fold at points (N, 3); beyond edges a bound."""
        result = np.full(len(points), np.float32(10))
        for feature in self.features:
            for part in feature.parts:
                own = part.distance(points)
                result = np.minimum(result, own) if feature.added else np.maximum(result, -own)
        return result

    def body(self) -> Manifold:
        """The fold itself, with chords."""
        result = Manifold()
        for feature in self.features:
            for part in feature.parts:
                whole = solid_of(part, _CHORD)
                result = result + whole if feature.added else result - whole
        return result

    def first(self, count: int) -> FeatureTree:
        """The tree of the first features; its scores are not known."""
        return FeatureTree(self.features[:count])

    @property
    def objective(self) -> float:
        return self.score - self.price

    @property
    def freeform(self) -> int:
        """How many of the features are the shape's own form, and none that was drawn."""
        return sum(feature.freeform for feature in self.features)


def fold(steps: Iterable[tuple[bool, NDArray[np.bool_]]], count: int) -> NDArray[np.bool_]:
    """Which of so many samples are covered: whether each step is added or cut, and its samples (N,)."""
    covered = np.zeros(count, bool)
    for added, within in steps:
        covered = covered | within if added else covered & ~within
    return covered


def image_of(part: Part, move: Similarity) -> Part:
    """The part and its copies mirrored in the plane x = 0, then moved."""
    return Motion(move, True).of(part)


def with_open_ends_everywhere(
    feature: Feature, distance: Callable[[np.ndarray], np.ndarray], reach: float
) -> Feature:
    """The feature, longer where its ends are open, as `with_open_ends`: in its mirror image, too."""
    longer = with_open_ends(feature.part, feature.added, distance, reach)
    if feature.image is not None and longer is not feature.part:
        image = with_open_ends(image_of(feature.part, feature.image), feature.added, distance, reach)
        if image.field.bounds()[1][2] != longer.field.bounds()[1][2]:
            return feature  # it goes on in but one of both places
    return replace(feature, part=longer)


def as_move(part: Part, image: Part) -> Similarity | None:
    """The rigid move that makes of a part its mirror image (as of `image_of`), of a box, say, if there is
    one."""
    turn, own = Similarity(), part.field
    if image.field != own and not _have_one_outline(own, image.field):
        if not isinstance(own, Extrusion) or own.taper or own.rims[0] != own.rims[1]:
            return None
        turn = Similarity(rotation=(0.0, 1.0, 0.0, 0.0))  # upside down it is its own mirror image
    return image.pose @ turn @ part.pose.inverse()


def _have_one_outline(own: Field, image: Field) -> bool:
    """Whether an extrusion is as its mirror image without being turned over, so that its ends stay where they
    are: one of them may be open."""
    if not isinstance(own, Extrusion) or not isinstance(image, Extrusion) or own.profile.holes:
        return False
    one, other = (np.array(field.profile.outline) for field in (own, image))
    return is_same_loop(one, other, _SAME * own.profile.size, _SAME)


def covers(part: Part, points: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie within the part or one of its copies."""
    result = np.zeros(len(points), bool)
    for copy in part.copies:
        near = np.flatnonzero(within_box(points, *copy.bounds()))
        if len(near):
            local = (points[near] - copy.translation) @ rotation_matrix(copy.rotation)
            result[near] |= copy.field(local) < 0
    return result


def within_box(points: NDArray[np.floating], low: ArrayLike, high: ArrayLike) -> NDArray[np.bool_]:
    """(N,) whether points (N, 3) lie between two corners (3,): column by column, which is the faster way."""
    within = np.ones(len(points), bool)
    for values, least, most in zip(points.T, np.asarray(low), np.asarray(high), strict=True):
        within &= values > least
        within &= values < most
    return within
