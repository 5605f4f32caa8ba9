"""Motions that may take one convex to another: told by their faces, and by turns about the axes of a part."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.motion import Motion, signed_permutations
from partwright.assembly.similarity import Similarity
from partwright.capri import quadric_rows as rows
from partwright.capri.quadric_rows import Row
from partwright.fields import Quadric

Array = NDArray[np.float64]

_FLAT = 1e-4  # of the largest curvature of a quadric, below which there is none
_SAME_DIRECTION = 0.02  # sine of the angle
_SAME_CURVATURE = 0.03  # of the larger one
_MIN_MATCHED = 3  # faces that stand for one another, or all that there are
_UNDETERMINED = 1e-3  # of the largest singular value: faces leave the place along such directions open
_SAME_AXIS = 0.02  # unit lengths, and sine of the angle
_MAX_AXES = 4
_SAME_TURN = 0.005  # radians
_SIGNED_PERMUTATIONS = signed_permutations()
_SAME_RADIUS = 0.08  # unit lengths: of the middles of two convexes from an axis, and between them along it


@dataclass(frozen=True)
class Line:
    """An axis of the part: a point (3,) on it and its direction (3,)."""

    point: Array
    direction: Array


@dataclass(frozen=True)
class Face:
    """A quadric of a convex by what a motion keeps of it: sorted curvatures (3,), all 0 for a plane, whose
    outward normal is the one column of `across`; else the directions (3, k) across which it curves, and
    `place` (3,), its middle."""

    curvatures: Array
    across: Array
    place: Array

    @classmethod
    def of(cls, row: Row) -> Face:
        form, slope, constant = rows.split(row)
        if not form.any():
            return cls(np.zeros(3), slope[:, None], -constant * slope)
        bent, vectors = np.linalg.eigh(form)
        flat = np.abs(bent) < _FLAT * np.abs(bent).max()
        return cls(bent, vectors[:, ~flat], -np.linalg.pinv(2 * form, rcond=_FLAT) @ slope)

    def is_like(self, other: Face, linear: Array) -> bool:
        """Whether a motion with the linear part (3, 3) may take it to the other."""
        if self.across.shape != other.across.shape:
            return False
        plane = not self.curvatures.any()
        if plane or not other.curvatures.any():
            both = plane and not other.curvatures.any()
            return bool(both and np.linalg.norm(linear @ self.across - other.across) < _SAME_DIRECTION)
        off = np.abs(self.curvatures - other.curvatures).max()
        if off > _SAME_CURVATURE * np.abs(self.curvatures).max():
            return False
        turned = linear @ self.across
        spans = turned @ turned.T - other.across @ other.across.T
        return bool(np.abs(spans).max() < 2 * _SAME_DIRECTION)


def moved(motion: Motion, table: Array) -> Array:
    """Quadrics (K, 10) as they are after a motion."""
    turn, offset = motion.linear, np.asarray(motion.move.translation)
    made = [Quadric(tuple(row.tolist())).moved(turn, offset).coefficients for row in table]
    return np.array(made, dtype=np.float64).reshape(-1, 10)


def motion_of(linear: Array, offset: Array) -> Motion:
    """Of an orthogonal (3, 3), which may mirror, and an offset (3,)."""
    mirror = bool(np.linalg.det(linear) < 0)
    move = Similarity.from_linear(linear * [-1.0, 1.0, 1.0] if mirror else linear, offset)
    # Of the scale exactly 1: quadrics that are scaled by as little as rounding are no copies any more.
    return Motion(replace(move, scale=1.0), mirror)


def axes_of(table: Array) -> list[Line]:
    """The axes about which most of the quadrics (K, 10) are round."""
    lines: list[Line] = []
    count: list[int] = []
    for row in table:
        form, _, _ = rows.split(row)
        if not form.any():
            continue
        bent, vectors = np.linalg.eigh(form)
        # A cylinder's or cone's axis is where the curvature is not as the two others.
        odd = 0 if abs(bent[1] - bent[2]) < abs(bent[0] - bent[1]) else 2
        if abs(bent[1] - bent[2 - odd]) > _SAME_CURVATURE * np.abs(bent).max():
            continue
        line = Line(Face.of(row).place, vectors[:, odd])
        for i, known in enumerate(lines):
            away = np.linalg.norm(np.cross(line.point - known.point, known.direction))
            tilt = np.linalg.norm(np.cross(line.direction, known.direction))
            if away < _SAME_AXIS and tilt < _SAME_AXIS:
                count[i] += 1
                break
        else:
            lines.append(line)
            count.append(1)
    return [lines[int(i)] for i in np.argsort(np.negative(count), kind="stable")[:_MAX_AXES]]


def by_faces(one: Sequence[Face], other: Sequence[Face], axes: Sequence[Line], most: int) -> list[Motion]:
    """At most so many motions that take faces of one convex to faces of the other, most faces first."""
    found: list[tuple[int, Motion]] = []
    for linear in _turns(one, other, axes):
        pairs = list(_matched(one, other, linear))
        if len(pairs) < min(_MIN_MATCHED, len(one), len(other)):
            continue
        equations = np.concatenate([b.across.T for _, b in pairs])
        sides = np.concatenate([b.across.T @ (b.place - linear @ a.place) for a, b in pairs])
        offset = np.linalg.lstsq(equations, sides, rcond=_UNDETERMINED)[0]
        found.append((-len(pairs), motion_of(linear, offset)))
    found.sort(key=lambda entry: entry[0])
    return [motion for _, motion in found[:most]]


def by_middles(one: Array, other: Array, axes: Sequence[Line], slack: Array) -> Iterator[Motion]:
    """Turns about the axes that take one middle (3,) to the other, and a little more or less by `slack`
    (K,)."""
    for axis in axes:
        a, b = one - axis.point, other - axis.point
        along = (a @ axis.direction, b @ axis.direction)
        a, b = a - along[0] * axis.direction, b - along[1] * axis.direction
        radii = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        apart = max(abs(float(along[0] - along[1])), abs(radii[0] - radii[1]))
        if apart > _SAME_RADIUS or min(radii) < _SAME_RADIUS:
            continue
        angle = float(np.arctan2(np.cross(a, b) @ axis.direction, a @ b))
        for more in slack:
            yield Motion(Similarity.turn(axis.direction.tolist(), angle + float(more), axis.point.tolist()))


def _matched(one: Sequence[Face], other: Sequence[Face], linear: Array) -> Iterator[tuple[Face, Face]]:
    left = list(other)
    for face in one:
        found = next((i for i, candidate in enumerate(left) if face.is_like(candidate, linear)), None)
        if found is not None:
            yield face, left.pop(found)


def _turns(one: Sequence[Face], other: Sequence[Face], axes: Sequence[Line]) -> Iterator[Array]:
    """The 48 that map coordinate axes to one another, and those about the part's axes that take a plane of
    one to a plane of the other, with and without a mirror."""
    yield from _SIGNED_PERMUTATIONS
    known = np.stack(_SIGNED_PERMUTATIONS)
    for axis in {tuple(line.direction.round(6)): line.direction for line in axes}.values():
        first, second = (
            [f.across[:, 0] for f in faces if not f.curvatures.any() and abs(f.across[:, 0] @ axis) < 0.02]
            for faces in (one, other)
        )
        side = np.eye(3)[np.argmin(np.abs(axis))]
        side = side - (side @ axis) * axis
        side /= np.linalg.norm(side)
        for flip in (np.eye(3), np.eye(3) - 2 * np.outer(side, side)):
            for a, b in itertools.product(first, second):
                from_ = flip @ a
                angle = float(np.arctan2(np.cross(from_, b) @ axis, from_ @ b))
                turn = Motion(Similarity.turn(axis.tolist(), angle)).linear @ flip
                if np.abs(known - turn).max(axis=(1, 2)).min() > _SAME_TURN:
                    known = np.concatenate([known, turn[None]])
                    yield turn
