"""Holes of an extrusion's profile as parts that are cut from it: each form once, with a copy a hole."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from partwright.approximation.profile_parts import with_profile
from partwright.assembly import Part, Similarity
from partwright.assembly.checks import Quaternion
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder, Extrusion
from partwright.fields.profile import Loop, Profile, circle_of, is_same_loop

_SAME = 2e-3  # of its size, by which holes that are alike may differ
_PLAIN = 1e-4  # unit lengths, by which they may differ, too: numbers become plain by as much
_SAME_BULGE = 0.02  # and their bulges by this
_PARALLEL = 1e-12  # of a cosine
_ASIDE = 1e-3  # unit lengths: how far axes of one hole may lie apart, and heights of copies differ
_LATTICE = 12  # points along a side of what is no round hole
_APART = 0.75  # of the length from end to end, that holes on one axis have which are apart
_BURR = 5e-3  # unit lengths: how deep within the shape a point of an empty hole may seem to lie


def holes_apart(part: Part) -> tuple[Part, tuple[Part, ...]]:
    """The part without holes that are round or come more than once, and what cuts these, each form once.

    Lengths in the unit frame. A part that is no extrusion, tapers or has rims stays as it is.
    """
    field = part.field
    if not isinstance(field, Extrusion) or field.taper or field.has_rims or not field.profile.holes:
        return part, ()
    groups: list[list[Loop]] = []
    for loop in field.profile.holes:
        same = next((group for group in groups if _alike(group[0], loop)), None)
        if same is None:
            groups.append([loop])
        else:
            same.append(loop)
    apart = [group for group in groups if len(group) > 1 or circle_of(group[0]) is not None]
    if not apart:
        return part, ()
    frame = rotation_matrix(part.rotation)
    kept = tuple(loop for group in groups if group not in apart for loop in group)
    body = with_profile(part, Profile(field.profile.outline, kept))
    holes = []
    for first, *others in apart:
        own = [_shift(frame, _middle(other) - _middle(first)) for other in others]
        moves = [*own, *(move @ inner for move in part.instances for inner in (Similarity(), *own))]
        holes.append(dataclasses.replace(with_profile(part, Profile(first)), instances=tuple(moves)))
    return dataclasses.replace(body, instances=part.instances, name=part.name), tuple(holes)


def hole_parts(part: Part) -> tuple[Part, ...]:
    """What cuts all holes of an extrusion without taper and rims, those that are alike as copies of one."""
    body, holes = holes_apart(part)
    field = body.field
    if not isinstance(field, Extrusion):
        return holes
    rest = (Extrusion(Profile(loop), field.height) for loop in field.profile.holes)
    own = (Part(solid, body.translation, body.rotation) for solid in rest)
    return (*holes, *own)


def _near(radius: float) -> float:
    """By how much the radii of holes of one size may differ."""
    return max(_SAME * radius, _PLAIN)


def _middle(loop: Loop) -> np.ndarray:
    """(2,) of its box."""
    lower, upper = Profile(loop).bounds()
    return np.asarray((lower + upper) / 2)


def _alike(one: Loop, other: Loop) -> bool:
    """Whether a shift takes one loop to the other, whichever corner each begins with."""
    round_, also = circle_of(one), circle_of(other)
    if round_ is not None and also is not None:
        return abs(round_[0] - also[0]) < _near(round_[0])
    if round_ is not None or also is not None:
        return False
    a, b = (np.array(loop) - (*_middle(loop), 0.0) for loop in (one, other))
    return is_same_loop(a, b, _SAME * float(np.ptp(a[:, :2], axis=0).max()), _SAME_BULGE)


def _shift(frame: np.ndarray, offset: np.ndarray) -> Similarity:
    x, y, z = (frame[:, :2] @ offset).tolist()
    return Similarity(translation=(x, y, z))


def is_empty(hole: Part, distance: Callable[[np.ndarray], np.ndarray]) -> bool:
    """Whether a cut holds nothing of the shape, all copies; distance: as of `merged_holes`."""
    return all(bool((distance(points_within(copy)) > -_BURR).all()) for copy in hole.copies)


def points_within(hole: Part) -> np.ndarray:
    """(N, 3) points within a cut."""
    if isinstance(hole.field, Cylinder):
        return _Drilled.of(hole).points()
    low, high = hole.field.bounds()
    steps = (np.arange(_LATTICE) + 0.5) / _LATTICE
    grid = low + np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3) * (
        high - low
    )
    inside = grid[hole.field(grid) < -_BURR]
    return np.asarray(inside @ rotation_matrix(hole.rotation).T + hole.translation)


def merged_holes(holes: Sequence[Part], distance: Callable[[np.ndarray], np.ndarray]) -> list[Part]:
    """Drilled holes: those on one axis of one radius as a single one, those of one size as copies of one, in
    one direction, or in several where a hole as given has copies that are turned so.

    distance: (N,) of the shape at points (N, 3), unit lengths like the holes. Where the shape is solid
    between two holes they stay two, and so do others that are copies of such: a pattern stays one.
    """
    drilled: list[tuple[_Drilled, list[Part]]] = []
    for hole in holes:
        for copy in hole.copies:
            one = _Drilled.of(copy)
            for k, (other, members) in enumerate(drilled):
                both = other.joined(one)
                if both is not None and (distance(both.points()) > -_BURR).all():
                    drilled[k] = both, [*members, one.part()]
                    break
            else:
                drilled.append((one, [one.part()]))
    alone = [members[0] for _, members in drilled if len(members) == 1]
    turns = [move for hole in holes for move in hole.instances]
    result: list[Part] = []
    for part in (part for whole, members in drilled for part in _of_pattern(whole.part(), members, alone)):
        moves = ((k, move) for k, other in enumerate(result) if (move := _shift_to(other, part)) is not None)
        turned = ((k, turn) for k, other in enumerate(result) for turn in turns if _is_at(other, turn, part))
        same, move = next(chain(moves, turned), (len(result), None))
        if move is None:
            result.append(part)
        else:
            result[same] = dataclasses.replace(result[same], instances=(*result[same].instances, move))
    return result


def _of_pattern(whole: Part, members: Sequence[Part], alone: Sequence[Part]) -> Sequence[Part]:
    """The holes that lie on one axis, where they are apart and others are copies of one of them; else the
    whole that they were joined to."""
    solid = sum(_height(member) for member in members)
    apart = len(members) > 1 and solid < _APART * _height(whole)
    return members if apart and any(_is_copy(a, b) for a in members for b in alone) else [whole]


def _height(hole: Part) -> float:
    assert isinstance(hole.field, Cylinder)
    return hole.field.height


@dataclass(frozen=True)
class _Drilled:
    """A hole of a radius from one point of its axis to another; rotation: of the part that it was."""

    radius: float
    start: np.ndarray
    end: np.ndarray
    rotation: Quaternion

    @classmethod
    def of(cls, part: Part) -> _Drilled:
        assert isinstance(part.field, Cylinder)
        half = rotation_matrix(part.rotation)[:, 2] * part.field.height / 2
        middle = np.array(part.translation)
        return cls(part.field.radius, middle - half, middle + half, part.rotation)

    def joined(self, other: _Drilled) -> _Drilled | None:
        """Both as one; None where they differ in axis or radius."""
        axis = (self.end - self.start) / np.linalg.norm(self.end - self.start)
        ends = np.stack([self.start, self.end, other.start, other.end])
        along = (ends - self.start) @ axis
        aside = np.linalg.norm(ends - self.start - along[:, None] * axis, axis=1)
        near = _near(max(self.radius, other.radius))
        if abs(self.radius - other.radius) > near or aside.max() > max(near, _ASIDE):
            return None
        low, high = float(along.min()), float(along.max())
        return dataclasses.replace(self, start=self.start + low * axis, end=self.start + high * axis)

    def points(self) -> np.ndarray:
        """(N, 3) within it."""
        frame = rotation_matrix(self.rotation)
        turns = np.arange(8) * (np.pi / 4)
        ring = 0.9 * self.radius * (np.column_stack([np.cos(turns), np.sin(turns)]) @ frame[:, :2].T)
        steps = np.linspace(0.02, 0.98, 25)[:, None, None]
        return np.asarray(self.start + steps * (self.end - self.start) + [*ring, np.zeros(3)]).reshape(-1, 3)

    def part(self) -> Part:
        x, y, z = ((self.start + self.end) / 2).tolist()
        height = float(np.linalg.norm(self.end - self.start))
        return Part(Cylinder(self.radius, height), (x, y, z), self.rotation)


def _is_copy(one: Part, other: Part) -> bool:
    """Whether a shift takes one hole to the other."""
    return _is_alike(one, other) and _is_parallel(one, other)


def _shift_to(one: Part, other: Part) -> Similarity | None:
    """What takes one hole to the other, if a shift does."""
    if not _is_copy(one, other):
        return None
    x, y, z = np.subtract(other.translation, one.translation).tolist()
    return Similarity(translation=(x, y, z))


def _is_at(one: Part, move: Similarity, other: Part) -> bool:
    """Whether a move takes the first of a hole's copies to the other hole."""
    if not _is_alike(one, other):
        return False
    moved = dataclasses.replace(one, instances=()).transformed(move)
    return _is_parallel(moved, other) and math.dist(moved.translation, other.translation) < _ASIDE


def _is_alike(one: Part, other: Part) -> bool:
    """Whether they are of one size."""
    assert isinstance(one.field, Cylinder)
    assert isinstance(other.field, Cylinder)
    return (
        abs(one.field.radius - other.field.radius) < _near(one.field.radius)
        and abs(one.field.height - other.field.height) < _ASIDE
    )


def _is_parallel(one: Part, other: Part) -> bool:
    own, axis = (rotation_matrix(part.rotation)[:, 2] for part in (one, other))
    return abs(float(own @ axis)) > 1 - _PARALLEL
