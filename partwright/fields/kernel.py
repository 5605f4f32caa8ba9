"""The C++ kernel's face: SuperFrusta over many points, their derivatives, and least-squares fits of them.

A *parameter row* holds one part, in the order of `columns.Column`: translation (3), rotation quaternion
w, x, y, z (local to world), size (3), roundness, dilation, taper, bulge, onion, the blend with which it joins
the fold (unused in the first row), and its sign: +1 where it is added to what came before it, -1 where it is
subtracted from that. The sign may be left out of all rows (M, 16): then every part is added.
Derivatives are in the order of `columns.Tangent`: translation (3), a local rotation vector w with
R <- R exp(w) (3), size (3), roundness, dilation, taper, bulge, onion, blend. `partwright.fields.reference` is
the slow form that tests compare with.

`threads=0` means one thread per core, and where several jobs run at once (at_once.py) each has its share of
them. Results do not depend on the number of threads.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright import _kernel
from partwright.at_once import share_of
from partwright.fields.columns import STEP_WIDTH, UNSIGNED, WIDTH

Rows = NDArray[np.float32]
Floats = NDArray[np.float32]


def _rows(parameters: ArrayLike) -> Rows:
    """The rows (M, 17) with their signs."""
    rows = np.ascontiguousarray(parameters, dtype=np.float32)
    if rows.ndim != 2 or rows.shape[1] not in (UNSIGNED, WIDTH) or len(rows) == 0:
        raise ValueError(f"parameter rows must be (M, {UNSIGNED} or {WIDTH}), M > 0, got {rows.shape}")
    if rows.shape[1] == UNSIGNED:
        return np.concatenate([rows, np.ones((len(rows), 1), np.float32)], axis=1)
    return rows


def like(rows: Rows, given: ArrayLike) -> Rows:
    """Rows with signs, or without where the rows given had none."""
    return rows[:, : np.shape(given)[1]]


def _points(points: ArrayLike) -> Floats:
    array = np.ascontiguousarray(points, dtype=np.float32)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must be (N, 3), got {array.shape}")
    return array


def evaluate(parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> Floats:
    """Distances (N,) of M parts, folded first to last: smooth unions (SuperFrusta, eq. 4) and differences."""
    return _kernel.evaluate(_rows(parameters), _points(points), share_of(threads))


def evaluate_parts(parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> Floats:
    """Distances (M, N) of each part alone."""
    return _kernel.evaluate_parts(_rows(parameters), _points(points), share_of(threads))


def covered(parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> NDArray[np.bool_]:
    """Whether each part alone covers each point (M, N): where its distance is below 0."""
    return _kernel.covered(_rows(parameters), _points(points), share_of(threads))


def occupancy_sums(
    occupied: NDArray[np.bool_],
    inside: NDArray[np.bool_],
    weight: ArrayLike,
    split: int,
    threads: int = 0,
) -> NDArray[np.float64]:
    """Weighted intersection and union of occupancies (K, N) with `inside` (N,).

    Returns (K, 2, 2): those over the points before `split`, then over the others.
    """
    weights = np.ascontiguousarray(weight, np.float32)
    if occupied.ndim != 2 or not occupied.shape[1:] == inside.shape == weights.shape:
        raise ValueError(f"shapes {occupied.shape}, {inside.shape}, {weights.shape} do not go together")
    if not 0 <= split <= len(weights):
        raise ValueError(f"split: expected 0 to {len(weights)}, got {split}")
    covered, true = (np.ascontiguousarray(one, dtype=bool).view(np.uint8) for one in (occupied, inside))
    return _kernel.occupancy_sums(covered, true, weights, split, share_of(threads))


def gradients(
    parameters: ArrayLike, points: ArrayLike, upstream: ArrayLike, threads: int = 0
) -> NDArray[np.float64]:
    """Derivatives (M, 15) of sum(upstream * distance) by the parameters, in the order of `Tangent`."""
    points = _points(points)
    weights = np.ascontiguousarray(upstream, dtype=np.float32)
    if weights.shape != (len(points),):
        raise ValueError(f"upstream must be ({len(points)},), got {weights.shape}")
    return _kernel.gradients(_rows(parameters), points, weights, share_of(threads))


@dataclass(frozen=True)
class Target:
    """What a fit compares with: the shape's signed distance (N,) and a weight (N,) at points (N, 3).

    `background` (N,) is the distance of parts that stay as they are; it joins the fold first.
    """

    points: Floats
    distance: Floats
    weight: Floats
    background: Floats = field(default_factory=lambda: np.empty(0, np.float32))

    def __post_init__(self) -> None:
        count = len(_points(self.points))
        for name in ("distance", "weight", "background"):
            array = getattr(self, name)
            if array.shape != (count,) and not (name == "background" and array.size == 0):
                raise ValueError(f"{name} must be ({count},), got {array.shape}")

    def arrays(self) -> tuple[Floats, Floats, Floats, Floats]:
        points, distance, weight, background = (
            np.ascontiguousarray(a, dtype=np.float32)
            for a in (self.points, self.distance, self.weight, self.background)
        )
        return points, distance, weight, background


@dataclass(frozen=True)
class Penalties:
    """Weights, relative to the reconstruction, of overlap and smooth-union consistency (eq. 8)."""

    overlap: float = 0.0
    blending: float = 0.0


@dataclass(frozen=True)
class Limits:
    """Per derivative: lower and upper bound of the parameter (shape parameters only) and the longest step."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    step: tuple[float, ...]

    def array(self) -> Floats:
        return np.ascontiguousarray([self.lower, self.upper, self.step], dtype=np.float32)


def normal_equations(
    parameters: ArrayLike, target: Target, beta: float, penalties: Penalties = Penalties(), threads: int = 0
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """Loss, gradient J^T r (15 M,) and Gauss-Newton matrix J^T J (15 M, 15 M) of the weighted residuals.

    The residuals are sqrt(weight) * (sigmoid(-beta * F) - sigmoid(-beta * distance)) and the two penalties;
    the loss is half their sum of squares. A soft target costs nothing where F equals the distance, which a
    hard one does, and fits better.
    """
    rows = _rows(parameters)
    live = np.ones(len(rows), np.uint8)
    return _kernel.normal_equations(
        rows, live, *target.arrays(), beta, penalties.overlap, penalties.blending, share_of(threads)
    )


def loss(
    parameters: ArrayLike, target: Target, beta: float, penalties: Penalties = Penalties(), threads: int = 0
) -> float:
    """Half the sum of squared residuals, as in `normal_equations`."""
    return _kernel.loss(
        _rows(parameters), *target.arrays(), beta, penalties.overlap, penalties.blending, share_of(threads)
    )


def levenberg_marquardt(
    parameters: ArrayLike,
    target: Target,
    stages: ArrayLike,
    limits: Limits,
    *,
    free: NDArray[np.bool_] | None = None,
    tied: NDArray[np.bool_] | None = None,
    penalties: Penalties = Penalties(),
    threads: int = 0,
) -> tuple[Rows, float, int]:
    """Minimises the loss over the entries that `free` (M, 15) marks; returns rows, loss and iterations.

    `stages` (S, 2) holds pairs of beta and iterations, run one after another. `tied` (M,) keeps sx = sy.
    """
    rows = _rows(parameters)
    free = np.ones((len(rows), STEP_WIDTH), bool) if free is None else free
    tied = np.zeros(len(rows), bool) if tied is None else tied
    fitted, loss, iterations = _kernel.levenberg_marquardt(
        rows, free.astype(np.uint8), tied.astype(np.uint8), *target.arrays(),
        np.ascontiguousarray(stages, np.float32), penalties.overlap, penalties.blending, limits.array(),
        share_of(threads),
    )  # fmt: skip
    return like(fitted, parameters), loss, iterations


def fit_starts(
    starts: ArrayLike,
    ranges: NDArray[np.int64],
    target: Target,
    stages: ArrayLike,
    limits: Limits,
    *,
    free: NDArray[np.bool_] | None = None,
    tied: NDArray[np.bool_] | None = None,
    penalties: Penalties = Penalties(),
    threads: int = 0,
) -> tuple[Rows, NDArray[np.float64]]:
    """One single-part fit per start (B, 17), on the samples `ranges[b, 0]:ranges[b, 1]`; rows and losses."""
    rows = _rows(starts)
    free = np.ones((len(rows), STEP_WIDTH), bool) if free is None else free
    tied = np.zeros(len(rows), bool) if tied is None else tied
    first, last = (np.ascontiguousarray(column, np.int64) for column in np.asarray(ranges).T)
    fitted, losses = _kernel.fit_starts(
        rows, first, last, free.astype(np.uint8), tied.astype(np.uint8), *target.arrays(),
        np.ascontiguousarray(stages, np.float32), penalties.overlap, penalties.blending, limits.array(),
        share_of(threads),
    )  # fmt: skip
    return like(fitted, starts), losses


def removal_counts(
    parameters: ArrayLike, points: ArrayLike, inside: NDArray[np.bool_], weight: ArrayLike, threads: int = 0
) -> NDArray[np.float64]:
    """Weighted intersection and union (M + 1, 2) with the occupancy `inside` (N,).

    Row i < M is the assembly without part i, the last row the whole assembly.
    """
    return _kernel.removal_counts(
        _rows(parameters), _points(points), np.ascontiguousarray(inside, np.uint8),
        np.ascontiguousarray(weight, np.float32), share_of(threads),
    )  # fmt: skip


def decompose(
    field: ArrayLike, spacing: float, regions: int, fraction: float, least_depth: float, least_voxels: float
) -> tuple[NDArray[np.int32], list[float]]:
    """Morphological decomposition (eq. 5-6) of {field < 0} on a grid (X, Y, Z) with voxels of size `spacing`.

    Returns the region of each voxel (-1 outside all), thickest first, and each region's erosion depth.
    `fraction` is kappa, of the volume that is left; regions shallower than `least_depth` (length) or smaller
    than `least_voxels` end the decomposition.
    """
    grid = np.ascontiguousarray(field, np.float32)
    if grid.ndim != 3:
        raise ValueError(f"the field must be (X, Y, Z), got {grid.shape}")
    return _kernel.decompose(grid, spacing, regions, fraction, least_depth, least_voxels)
