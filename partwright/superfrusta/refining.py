"""Optimisation of a whole assembly, or of some of its parts while the others stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.fields import kernel
from partwright.fields.columns import STEP_WIDTH, Tangent
from partwright.superfrusta.families import locked_values
from partwright.superfrusta.limits import LIMITS
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.solid_kinds import kind_freedom, round_parts

START_BLEND = 0.02

# Sharpness of the occupancy sigmoid and iterations, for solids of ordinary thickness.
COARSE_TO_FINE = ((15.0, 10), (40.0, 10), (100.0, 8))
FINE = ((40.0, 10), (100.0, 8))
TOUCH_UP = ((40.0, 4), (100.0, 4))
POLISH = ((40.0, 6), (100.0, 12), (200.0, 10))

_FELT = 0.15  # unit lengths from a part within which its samples lie
_FAR_EVERY = 8

Stages = tuple[tuple[float, int], ...]


def sharpened(stages: Stages, thickness: float) -> NDArray[np.float32]:
    """Stages (S, 2) for a solid of the given depth: at beta * depth << 1 the sigmoid sees no thin wall."""
    factor = float(np.clip(0.04 / max(thickness, 1e-6), 1.0, 4.0))
    return np.array([(beta * factor, iterations) for beta, iterations in stages], dtype=np.float32)


def penalties(settings: Settings) -> kernel.Penalties:
    return kernel.Penalties(settings.overlap, settings.blending)


def freedom(rows: Rows, moving: NDArray[np.bool_], settings: Settings) -> NDArray[np.bool_]:
    """Which parameters (M, 15) may move: all of the parts marked in `moving` (M,), less those locked by the
    family or, among solids, by the part's kind."""
    free = np.repeat(moving[:, None], STEP_WIDTH, axis=1)
    if settings.family == "solid":
        return free & kind_freedom(rows)
    locked = locked_values(settings.family, settings.smooth)
    free[:, [Tangent[column.name] for column in locked]] = False
    return free


def ties(rows: Rows, settings: Settings) -> NDArray[np.bool_]:
    """Parts (M,) that stay round: sx and sy move as one."""
    return round_parts(rows) if settings.family == "solid" else np.zeros(len(rows), bool)


def optimise(samples: FitSamples, rows: Rows, stages: Stages, settings: Settings, locked: int = 0) -> Rows:
    """Optimises the whole assembly but the first `locked` parts, by the optimiser that the settings name.

    The paper's own may return fewer parts: those whose existence it gave up.
    """
    if settings.optimiser == "adam":
        from partwright.superfrusta import paper  # which imports torch: an extra

        index = samples.optimised_indices
        config = paper.PaperConfig()
        return paper.optimise(
            rows,
            samples.points[index],
            samples.distance[index],
            samples.weight[index],
            config=config,
            seed=samples.seed,
            locked=locked,
            device="cuda" if samples.device == "cuda" else "cpu",
        ).rows
    return refine(samples, rows, stages, settings, np.arange(len(rows)) >= locked)


def refine(
    samples: FitSamples,
    rows: Rows,
    stages: Stages,
    settings: Settings,
    moving: NDArray[np.bool_] | None = None,
    target: kernel.Target | None = None,
) -> Rows:
    """Minimises the reconstruction and quality losses (eq. 7-8) over the parts marked in `moving` (M,).

    target: other samples, or other weights, than those that all optimisation runs on.
    """
    moving = np.ones(len(rows), bool) if moving is None else moving
    if not moving.any():
        return rows
    target = samples.target(samples.optimised_indices) if target is None else target
    if not moving.all():
        target = _about(samples, rows[moving], target)
    refined, _, _ = samples.kernel.levenberg_marquardt(
        rows,
        target,
        sharpened(stages, samples.thickness),
        LIMITS,
        free=freedom(rows, moving, settings),
        tied=ties(rows, settings),
        penalties=penalties(settings),
        threads=samples.threads,
    )
    return refined


def _about(samples: FitSamples, moving: Rows, target: kernel.Target) -> kernel.Target:
    """The samples that moving parts can feel; a few of the others, at more weight, stand for all of them."""
    near = (samples.parts_of(moving, target.points) < _FELT).any(axis=0)
    far = np.flatnonzero(~near)[::_FAR_EVERY]
    index = np.concatenate([np.flatnonzero(near), far])
    weight = target.weight[index].copy()
    weight[len(index) - len(far) :] *= _FAR_EVERY
    return kernel.Target(target.points[index], target.distance[index], weight)
