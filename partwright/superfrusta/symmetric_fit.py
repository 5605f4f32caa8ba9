"""Least squares over repeated parts: the copies of a leaf move together, as its isometries say."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from partwright.rows import lengths
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
    def rows(self) -> Rows:
        """(1 + copies, 17), the leaf itself first."""
        return np.concatenate([self.row[None], images(self.row[None], self.isometries)[:, 0]])

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
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, moved - linear @ place
    return Similarity.from_matrix(matrix)


def images(rows: Rows, isometries: Sequence[Isometry]) -> Rows:
    """Rows (K, M, 17) of the images of parts (M, 17) under isometries: each `rigid` move, all at once."""
    found = np.repeat(rows[None].astype(np.float32), len(isometries), axis=0)
    if not len(isometries):
        return found
    linear = np.stack([one.linear for one in isometries])[:, None]
    shift = np.stack([one.shift for one in isometries])[:, None]
    flips = np.stack([_FLIP if one.improper else np.eye(3) for one in isometries])[:, None]
    place = rows[:, TRANSLATION].astype(np.float64)
    pose = rows[:, ROTATION].astype(np.float64)
    pose /= lengths(pose)[:, None]
    turns = Rotation.from_quat(pose, scalar_first=True).as_matrix()
    moves = quaternions(linear @ turns @ flips @ turns.transpose(0, 2, 1))
    found[..., TRANSLATION] = (linear @ place[..., None])[..., 0] + shift
    found[..., ROTATION] = np.stack(quaternion_product(_components(moves), _components(pose)), axis=-1)
    return found


def _components(rotations: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    return rotations[..., 0], rotations[..., 1], rotations[..., 2], rotations[..., 3]


def expanded(leaves: Sequence[RepeatedPart]) -> Rows:
    """Rows of all copies, leaf by leaf."""
    return np.concatenate([leaf.rows for leaf in leaves])


def refit(
    samples: FitSamples, leaves: Sequence[RepeatedPart], stages: Stages, settings: Settings, locked: int = 0
) -> list[RepeatedPart]:
    """Minimises the losses of `refine` over the leaves, all copies of each moving as one.

    The kernel's normal equations of all copies are projected onto the leaves' parameters; the damped steps
    are those of Levenberg and Marquardt. The first `locked` leaves stay.
    """
    parts = list(leaves)
    target = samples.target(samples.optimised_indices)
    moving = np.arange(len(leaves)) >= locked
    firsts = np.stack([leaf.row for leaf in leaves])
    tied = ties(firsts, settings)
    free = freedom(firsts, moving, settings)
    free[tied, Tangent.SY] = False
    free_entries = np.flatnonzero(free)
    damping = _DAMPING
    for beta, iterations in sharpened(stages, samples.thickness):
        terms = (target, float(beta), penalties(settings), samples.threads)

        def linearise(at: list[RepeatedPart], terms: Terms = terms) -> tuple[float, Floats, Floats]:
            loss, gradient, matrix = samples.kernel.normal_equations(expanded(at), *terms)
            gradient, matrix = _projected(at, tied, gradient, matrix)
            return loss, gradient[free_entries], matrix[np.ix_(free_entries, free_entries)]

        def loss(at: list[RepeatedPart], terms: Terms = terms) -> float:
            return samples.kernel.loss(expanded(at), *terms)

        def move(at: list[RepeatedPart], entries: Floats) -> list[RepeatedPart]:
            step = np.zeros(free.shape)
            step[free] = entries
            return [
                _moved(part, s, f, t) if moves else part
                for part, s, f, t, moves in zip(at, step, free, tied, moving, strict=True)
            ]

        found = minimise(parts, linearise, loss, move, replace(damping, trials=int(iterations)))
        parts, damping = found.state, replace(damping, start=found.damping)
    return parts


def _projected(
    leaves: Sequence[RepeatedPart], tied: NDArray[np.bool_], gradient: Floats, matrix: Floats
) -> tuple[Floats, Floats]:
    """P^T g and P^T H P, where P takes steps of the leaves to steps of their copies."""
    count = sum(1 + len(leaf.isometries) for leaf in leaves)
    lift = np.zeros((count, STEP_WIDTH, len(leaves), STEP_WIDTH))
    at = 0
    for i, leaf in enumerate(leaves):
        for block in [np.eye(STEP_WIDTH), *(_lifted(isometry) for isometry in leaf.isometries)]:
            if tied[i]:
                block[Tangent.SY] = block[Tangent.SX]
            lift[at, :, i] = block
            at += 1
    flat = lift.reshape(count * STEP_WIDTH, -1)
    return flat.T @ gradient, flat.T @ matrix @ flat


def _lifted(isometry: Isometry) -> Floats:
    """(15, 15) a copy's step by the leaf's: the place moves in the world, the turn is about local axes."""
    block = np.eye(STEP_WIDTH)
    block[TRANSLATION_STEP, TRANSLATION_STEP] = isometry.linear
    if isometry.improper:
        block[ROTATION_STEP, ROTATION_STEP] = -_FLIP  # exp(v) becomes F exp(v) F = exp(det(F) F v)
    return block


def _moved(leaf: RepeatedPart, step: Floats, free: NDArray[np.bool_], tied: bool) -> RepeatedPart:
    """The leaf after a step (15,), clipped, within bounds; what is not `free` (15,) keeps its bits."""
    lower, upper, longest = LIMITS.array().astype(np.float64)
    step = np.clip(step, -longest, longest)
    row = leaf.row.astype(np.float64)
    row[TRANSLATION] += step[TRANSLATION_STEP]
    angle = float(np.linalg.norm(step[ROTATION_STEP]))
    half = np.sinc(angle / (2 * math.pi)) / 2
    turn = Similarity(1.0, (math.cos(angle / 2), *(half * step[ROTATION_STEP]).tolist()))
    row[ROTATION] = (_pose(leaf.row) @ turn).rotation
    shape = row[SHAPE]
    moved = np.clip(shape + step[SHAPE_STEP], lower[SHAPE_STEP], upper[SHAPE_STEP])
    row[SHAPE] = np.where(free[SHAPE_STEP], moved, shape)
    if tied and free[Tangent.SX]:
        row[Column.SY] = row[Column.SX]
    if free[Tangent.BULGE]:
        row[Column.BULGE] = min(row[Column.BULGE], tightest_bulge(row[Column.SX], row[Column.SZ]))
    return RepeatedPart(row.astype(np.float32), leaf.isometries)


def _pose(row: NDArray[np.float32]) -> Similarity:
    tx, ty, tz, qw, qx, qy, qz = (float(v) for v in row[POSE])
    return Similarity(1.0, (qw, qx, qy, qz), (tx, ty, tz))
