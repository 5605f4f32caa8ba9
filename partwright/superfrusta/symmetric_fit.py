"""Least squares over repeated parts: the copies of a leaf move together, as its isometries say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.assembly import Similarity
from partwright.assembly.similarity import quaternion_product, quaternions
from partwright.fields import kernel
from partwright.fields.columns import (
    POSE,
    ROTATION,
    ROTATION_STEP,
    SHAPE,
    SHAPE_STEP,
    STEP_WIDTH,
    TRANSLATION,
    TRANSLATION_STEP,
    Column,
    Tangent,
)
from partwright.fields.superfrustum import tightest_bulge
from partwright.least_squares import Damping, minimise
from partwright.rows import lengths, units
from partwright.superfrusta.limits import LIMITS
from partwright.superfrusta.refining import Stages, freedom, penalties, sharpened, ties
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetry import Isometry

Floats = NDArray[np.float64]

# A SuperFrustum is symmetric in its local y: a mirrored one is the same field in another rigid pose.
_FLIP = np.diag([1.0, -1.0, 1.0])
_DAMPING = Damping(trials=0, start=1e-2, down=0.3, up=5.0, least=1e-6, floor=1e-6, settled=3e-4)

Terms = tuple[kernel.Target, float, kernel.Penalties, int]


@dataclass(frozen=True)
class RepeatedPart:
    """A parameter row (17,) and the isometries that make its further copies."""

    row: NDArray[np.float32]
    isometries: tuple[Isometry, ...] = ()

    @property
    def moves(self) -> tuple[Similarity, ...]:
        """The copies' rigid moves: what `Part.instances` holds."""
        return tuple(rigid(self.row, isometry) for isometry in self.isometries)


def rigid(row: NDArray[np.float32], isometry: Isometry) -> Similarity:
    """The rigid move that takes a part to its image; an improper isometry is made up for by a local flip."""
    pose = _pose(row)
    linear = isometry.linear
    if isometry.improper:
        turn = pose.matrix()[:3, :3]
        linear = linear @ turn @ _FLIP @ turn.T
    place = np.array(pose.translation)
    moved = isometry(place[None])[0]
    return Similarity.from_linear(linear, moved - linear @ place)


def images(rows: Rows, isometries: Sequence[Isometry]) -> Rows:
    """Rows (K, M, 17) of the images of parts (M, 17) under isometries: each `rigid` move, all at once."""
    if not len(isometries):
        return np.empty((0, *rows.shape), np.float32)
    return _images(rows[None], _Isometries.of(isometries), (slice(None), None))


@dataclass(frozen=True)
class _Isometries:
    """Several (C,) at once."""

    linear: Floats
    """(C, 3, 3)"""
    shift: Floats
    """(C, 3)"""
    flips: Floats
    """(C, 3, 3) what makes up for an improper one, in the frame of a part."""

    @classmethod
    def of(cls, isometries: Sequence[Isometry]) -> _Isometries:
        return cls(
            np.array([one.linear for one in isometries]).reshape(-1, 3, 3),
            np.array([one.shift for one in isometries]).reshape(-1, 3),
            np.array([_FLIP if one.improper else np.eye(3) for one in isometries]).reshape(-1, 3, 3),
        )


def _images(rows: Rows, by: _Isometries, each: Any = ...) -> Rows:
    """Rows (..., 17) moved by isometries, of which `each` are those of the rows."""
    linear, shift, flips = by.linear[each], by.shift[each], by.flips[each]
    place, pose = rows[..., TRANSLATION].astype(np.float64), rows[..., ROTATION].astype(np.float64)
    pose /= lengths(pose)[..., None]
    turns = (
        Rotation.from_quat(pose.reshape(-1, 4), scalar_first=True).as_matrix().reshape(*pose.shape[:-1], 3, 3)
    )
    moves = quaternions(linear @ turns @ flips @ turns.swapaxes(-1, -2))
    found = np.array(np.broadcast_to(rows, (*moves.shape[:-1], rows.shape[-1])), np.float32)
    found[..., TRANSLATION] = (linear @ place[..., None])[..., 0] + shift
    found[..., ROTATION] = np.stack(quaternion_product(_components(moves), _components(pose)), axis=-1)
    return found


def _components(rotations: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    return rotations[..., 0], rotations[..., 1], rotations[..., 2], rotations[..., 3]


@dataclass(frozen=True)
class _Copies:
    """All copies (C,) of leaves (L,), leaf by leaf, each leaf itself first.

    leaf: (C,) that each is of. moved: those that are not the leaf itself, and by what.
    """

    leaf: NDArray[np.int64]
    moved: NDArray[np.int64]
    by: _Isometries

    @classmethod
    def of(cls, leaves: Sequence[RepeatedPart]) -> _Copies:
        counts = np.array([1 + len(leaf.isometries) for leaf in leaves])
        firsts = np.cumsum(counts) - counts
        moved = np.setdiff1d(np.arange(counts.sum()), firsts)
        every = [isometry for leaf in leaves for isometry in leaf.isometries]
        return cls(np.repeat(np.arange(len(leaves)), counts), moved, _Isometries.of(every))

    def rows(self, firsts: Rows) -> Rows:
        """(C, 17) of the leaves' rows (L, 17)."""
        found = firsts[self.leaf]
        if len(self.moved):
            found[self.moved] = _images(found[self.moved], self.by)
        return found

    def lift(self, tied: NDArray[np.bool_]) -> Floats:
        """(C, 15, 15) what takes steps of each copy's leaf to its own: it moves in the world and turns about
        local axes."""
        blocks = np.tile(np.eye(STEP_WIDTH), (len(self.leaf), 1, 1))
        blocks[self.moved, TRANSLATION_STEP, TRANSLATION_STEP] = self.by.linear
        improper = (self.by.flips != np.eye(3)).any(axis=(1, 2))
        # exp(v) becomes F exp(v) F = exp(det(F) F v)
        blocks[self.moved[improper], ROTATION_STEP, ROTATION_STEP] = -_FLIP
        round_ = tied[self.leaf]
        blocks[round_, Tangent.SY] = blocks[round_, Tangent.SX]
        return blocks

    def summed(self, values: Floats) -> Floats:
        """(L, ...) of each leaf, of values (C, ...) of the copies."""
        return np.asarray(np.add.reduceat(values, np.flatnonzero(np.diff(self.leaf, prepend=-1)), axis=0))


def expanded(leaves: Sequence[RepeatedPart]) -> Rows:
    """Rows of all copies, leaf by leaf, each leaf itself first."""
    return _Copies.of(leaves).rows(np.stack([leaf.row for leaf in leaves]))


def refit(
    samples: FitSamples, leaves: Sequence[RepeatedPart], stages: Stages, settings: Settings, locked: int = 0
) -> list[RepeatedPart]:
    """Minimises the losses of `refine` over the leaves, all copies of each moving as one.

    The kernel's normal equations of all copies are projected onto the leaves' parameters; the damped steps
    are those of Levenberg and Marquardt. The first `locked` leaves stay.
    """
    target = samples.target(samples.optimised_indices)
    rows = np.stack([leaf.row for leaf in leaves])
    steps = LeafSteps.of(leaves, settings, np.arange(len(leaves)) >= locked)
    damping = _DAMPING
    for beta, iterations in sharpened(stages, samples.thickness):
        terms = (target, float(beta), penalties(settings), samples.threads)

        def linearise(at: Rows, terms: Terms = terms) -> tuple[float, Floats, Floats]:
            loss, gradient, matrix = samples.kernel.normal_equations(steps.copies(at), *terms)
            return loss, *steps.projected(gradient, matrix)

        def loss(at: Rows, terms: Terms = terms) -> float:
            return samples.kernel.loss(steps.copies(at), *terms)

        found = minimise(rows, linearise, loss, steps.taken, replace(damping, trials=int(iterations)))
        rows, damping = found.state, replace(damping, start=found.damping)
    return [RepeatedPart(row, leaf.isometries) for row, leaf in zip(rows, leaves, strict=True)]


@dataclass(frozen=True)
class LeafSteps:
    """How leaves (L,) move, those that are `moving` (L,), all copies of each as one."""

    moving: NDArray[np.bool_]
    _copies: _Copies
    _free: NDArray[np.bool_]
    _tied: NDArray[np.bool_]
    _lift: Floats

    @classmethod
    def of(cls, leaves: Sequence[RepeatedPart], settings: Settings, moving: NDArray[np.bool_]) -> LeafSteps:
        rows = np.stack([leaf.row for leaf in leaves])
        tied = ties(rows, settings)
        free = freedom(rows, moving, settings)
        free[tied, Tangent.SY] = False
        copies = _Copies.of(leaves)
        return cls(moving, copies, free, tied, copies.lift(tied))

    @property
    def leaf(self) -> NDArray[np.int64]:
        """(C,) that each copy is of."""
        return self._copies.leaf

    def copies(self, rows: Rows) -> Rows:
        """(C, 17) of the leaves' rows (L, 17)."""
        return self._copies.rows(rows)

    def projected(self, gradient: Floats, matrix: Floats) -> tuple[Floats, Floats]:
        """Normal equations of all copies as those of the entries (n,) that may move."""
        copies, summed = len(self.leaf), self._copies.summed
        by_copy = (copies, STEP_WIDTH, -1)
        back = self._lift.swapaxes(1, 2)
        right = summed(matrix.reshape(-1, copies, STEP_WIDTH).swapaxes(0, 1) @ self._lift)  # (L, C * 15, 15)
        both = summed(back @ right.swapaxes(0, 1).reshape(by_copy))  # (L, 15, L * 15)
        may = np.flatnonzero(self._free)
        one = summed(back @ gradient.reshape(by_copy)).ravel()
        return one[may], both.reshape(-1, both.shape[-1])[np.ix_(may, may)]

    def taken(self, rows: Rows, entries: Floats) -> Rows:
        """The leaves' rows after a step (n,) of what may move."""
        step = np.zeros(self._free.shape)
        step[self._free] = entries
        return np.where(self.moving[:, None], _moved(rows, step, self._free, self._tied), rows)


def _moved(rows: Rows, step: Floats, free: NDArray[np.bool_], tied: NDArray[np.bool_]) -> Rows:
    """Leaves (L, 17) after a step (L, 15), clipped, within bounds; what of their form is not `free` (L, 15)
    keeps its bits."""
    lower, upper, longest = LIMITS.array().astype(np.float64)
    step = np.clip(step, -longest, longest)
    moved = rows.astype(np.float64)
    moved[:, TRANSLATION] += step[:, TRANSLATION_STEP]
    angle = lengths(step[:, ROTATION_STEP])[:, None]
    turn = np.hstack([np.cos(angle / 2), np.sinc(angle / (2 * math.pi)) / 2 * step[:, ROTATION_STEP]])
    pose = units(moved[:, ROTATION])
    moved[:, ROTATION] = units(np.stack(quaternion_product(_components(pose), _components(turn)), axis=-1))
    clipped = np.clip(moved[:, SHAPE] + step[:, SHAPE_STEP], lower[SHAPE_STEP], upper[SHAPE_STEP])
    moved[:, SHAPE] = np.where(free[:, SHAPE_STEP], clipped, moved[:, SHAPE])
    for row, before, loose, is_round in zip(moved, rows, free, tied, strict=True):
        if is_round and loose[Tangent.SX]:
            row[Column.SY] = row[Column.SX]
        if loose[Tangent.BULGE]:
            # What is bent further already may stay so: all steps would end with it unbent.
            tightest = max(tightest_bulge(row[Column.SX], row[Column.SZ]), float(before[Column.BULGE]))
            row[Column.BULGE] = min(row[Column.BULGE], tightest)
    return moved.astype(np.float32)


def _pose(row: NDArray[np.float32]) -> Similarity:
    tx, ty, tz, qw, qx, qy, qz = (float(v) for v in row[POSE])
    return Similarity(1.0, (qw, qx, qy, qz), (tx, ty, tz))
