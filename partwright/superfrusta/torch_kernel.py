"""The kernel's evaluations and fits in PyTorch: the same functions as `fields.kernel`, for a CUDA device.

Every fit is a batch of B assemblies of M parts with P samples each: a whole assembly is a batch of one, the
starts of `fit_starts` are B assemblies of one part. Steps, bounds and acceptance are those of
cpp/optimise.cpp; each assembly of the batch has its own damping and ends on its own. Distances come from
`fields.reference` in float32, sums over samples and linear solves are float64. Steps are solved
for by dense factorisation and saturated points keep their share of the gradient, where the compiled kernel
is content with a thousandth. A fit whose minimum is not sharp may therefore end elsewhere.

Costs of a step: the derivatives (one reverse pass over the pairs of part and point that the loss can feel)
and J^T J, which take about a third each on a CPU with 24 parts; then the distances. A step is over a thousand
operations however few the samples, so a small fit on a GPU waits for their launches.

Repeats to the bit on the same device with the same number of torch threads.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from partwright.fields import kernel
from partwright.fields.columns import STEP_WIDTH, Column, Tangent
from partwright.fields.kernel import Floats, Limits, Penalties, Rows, Target, _points, _rows, like
from partwright.superfrusta.torch_equations import (
    Problem,
    SampleBatch,
    damped_step,
    distances,
    fold,
    fold_without,
    linearised,
    local_points,
    residuals,
)

# Memory that one pair of part and point takes at its peak: distances alone, and with derivatives.
FORWARD_BYTES, DERIVATIVE_BYTES = 200, 2000
# As in cpp/optimise.cpp.
START_DAMPING, LEAST_DAMPING, RELAX, TIGHTEN = 1e-2, 1e-6, 0.3, 6.0
ATTEMPTS, LEAST_GAIN = 5, 1e-4


class TorchKernel:
    """Evaluates and fits SuperFrusta on `device`; drop-in for the functions of `fields.kernel`.

    `memory` bounds, in bytes, what one call holds on the device beside its samples and its matrix. `threads`
    in the methods is part of the shared signature and has no effect: the device decides.
    """

    def __init__(self, device: str | torch.device = "cuda", memory: int = 1 << 30) -> None:
        self.device = torch.device(device)
        self.memory = memory

    @torch.no_grad()
    def evaluate(self, parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> Floats:
        """Distances (N,) of M parts folded first to last: smooth unions (SuperFrusta, eq. 4), differences."""
        rows = self._tensor(_rows(parameters))[None]
        folded = [fold(g, rows, None)[0][0] for g in self._distances(rows, points)]
        return _numpy(torch.cat(folded))

    @torch.no_grad()
    def evaluate_parts(self, parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> Floats:
        """Distances (M, N) of each part alone."""
        rows = self._tensor(_rows(parameters))[None]
        return _numpy(torch.cat([g[0] for g in self._distances(rows, points)], 1))

    def covered(self, parameters: ArrayLike, points: ArrayLike, threads: int = 0) -> NDArray[np.bool_]:
        """Whether each part alone covers each point (M, N): where its distance is below 0."""
        return np.asarray(self.evaluate_parts(parameters, points) < 0)

    @torch.no_grad()
    def removal_counts(
        self,
        parameters: ArrayLike,
        points: ArrayLike,
        inside: NDArray[np.bool_],
        weight: ArrayLike,
        threads: int = 0,
    ) -> NDArray[np.float64]:
        """Weighted intersection and union (M + 1, 2) with the occupancy `inside` (N,).

        Row i < M is the assembly without part i, the last row the whole assembly.
        """
        rows = self._tensor(_rows(parameters))[None]
        solid = torch.as_tensor(inside, dtype=torch.bool, device=self.device)
        mass = torch.as_tensor(weight, dtype=torch.float32, device=self.device)
        counts = torch.zeros(rows.shape[1] + 1, 2, dtype=torch.float64, device=self.device)
        first = 0
        for g in self._distances(rows, points):
            span = slice(first, first + g.shape[2])
            occupied = fold_without(g[0], rows[0]) < 0
            both, either = occupied & solid[span], occupied | solid[span]
            counts += torch.stack([(both * mass[span]).sum(1), (either * mass[span]).sum(1)], 1)
            first = span.stop
        return counts.cpu().numpy()

    def decompose(
        self,
        field: ArrayLike,
        spacing: float,
        regions: int,
        fraction: float,
        least_depth: float,
        least_voxels: float,
    ) -> tuple[NDArray[np.int32], list[float]]:
        """As in `fields.kernel`, and by it: distance transforms of one small grid, on the processor."""
        return kernel.decompose(field, spacing, regions, fraction, least_depth, least_voxels)

    @torch.no_grad()
    def normal_equations(
        self,
        parameters: ArrayLike,
        target: Target,
        beta: float,
        penalties: Penalties = Penalties(),  # noqa: B008 (frozen)
        threads: int = 0,
    ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Loss, gradient J^T r (15 M,) and Gauss-Newton matrix J^T J (15 M, 15 M) of the residuals."""
        rows = self._tensor(_rows(parameters))[None]
        every = torch.arange(rows.shape[1], device=self.device)
        system = self._system(rows, self._samples(target), every, beta, penalties)
        loss, gradient, matrix = (value[0].cpu().numpy() for value in system)
        return float(loss), gradient, matrix

    @torch.no_grad()
    def loss(
        self,
        parameters: ArrayLike,
        target: Target,
        beta: float,
        penalties: Penalties = Penalties(),  # noqa: B008
        threads: int = 0,
    ) -> float:
        """Half the sum of squared residuals, as in `normal_equations`."""
        rows = self._tensor(_rows(parameters))[None]
        return float(self._loss(rows, self._samples(target), beta, penalties))

    @torch.no_grad()
    def levenberg_marquardt(
        self,
        parameters: ArrayLike,
        target: Target,
        stages: ArrayLike,
        limits: Limits,
        *,
        free: NDArray[np.bool_] | None = None,
        tied: NDArray[np.bool_] | None = None,
        penalties: Penalties = Penalties(),  # noqa: B008
        threads: int = 0,
    ) -> tuple[Rows, float, int]:
        """Minimises the loss over the entries that `free` (M, 15) marks; returns rows, loss and iterations.

        `stages` (S, 2) holds pairs of beta and iterations, run one after another. `tied` (M,) keeps sx = sy.
        """
        rows = _rows(parameters)
        problem = self._problem(rows[None], self._samples(target), limits, free, tied, penalties)
        fitted, losses, iterations = self._minimise(problem, stages)
        return like(_numpy(fitted[0]), parameters), float(losses[0]), int(iterations[0])

    @torch.no_grad()
    def fit_starts(
        self,
        starts: ArrayLike,
        ranges: NDArray[np.int64],
        target: Target,
        stages: ArrayLike,
        limits: Limits,
        *,
        free: NDArray[np.bool_] | None = None,
        tied: NDArray[np.bool_] | None = None,
        penalties: Penalties = Penalties(),  # noqa: B008
        threads: int = 0,
    ) -> tuple[Rows, NDArray[np.float64]]:
        """One single-part fit per start (B, 17), each on the samples `ranges[b, 0]:ranges[b, 1]`.

        Returns rows and losses. All starts run as one batch; shorter ranges are padded with weight 0.
        """
        rows = _rows(starts)
        problem = self._problem(rows[:, None], self._ranges(target, ranges), limits, free, tied, penalties)
        fitted, losses, _ = self._minimise(problem, stages)
        return like(_numpy(fitted[:, 0]), starts), losses.cpu().numpy()

    def _tensor(self, array: NDArray) -> Tensor:
        return torch.as_tensor(array, device=self.device)

    def _span(self, pairs: int, bytes_each: int) -> int:
        """How many points fit into the memory when each brings this many pairs."""
        return max(1, self.memory // (bytes_each * pairs))

    def _distances(self, rows: Tensor, points: ArrayLike) -> Iterator[Tensor]:
        """Distances (1, M, n) of each part alone, for spans of the points (N, 3)."""
        span = self._span(rows.shape[1], FORWARD_BYTES)
        for piece in self._tensor(_points(points)).split(span):
            yield distances(rows, local_points(rows, piece[None]))

    def _samples(self, target: Target) -> SampleBatch:
        points, distance, weight, background = (self._tensor(array)[None] for array in target.arrays())
        return SampleBatch(points, distance, weight, background if background.numel() else None)

    def _ranges(self, target: Target, ranges: NDArray[np.int64]) -> SampleBatch:
        """SampleBatch of each range (B, 2), padded to the longest."""
        first, last = self._tensor(np.ascontiguousarray(ranges, np.int64)).unbind(1)
        offset = torch.arange(int((last - first).max()), device=self.device)
        index = first[:, None] + offset
        real = index < last[:, None]
        index = torch.where(real, index, 0)
        points, distance, weight, background = (self._tensor(array) for array in target.arrays())
        behind = background[index] if background.numel() else None
        return SampleBatch(points[index], distance[index], weight[index] * real, behind)

    def _problem(
        self,
        rows: NDArray[np.float32],
        samples: SampleBatch,
        limits: Limits,
        free: NDArray[np.bool_] | None,
        tied: NDArray[np.bool_] | None,
        penalties: Penalties,
    ) -> Problem:
        """`free` and `tied` as given by the caller, over all parts of all assemblies of `rows` (B, M, 17)."""
        batch = rows.shape[:2]
        free = np.ones((*batch, STEP_WIDTH), bool) if free is None else free.reshape(*batch, STEP_WIDTH)
        tied = np.zeros(batch, bool) if tied is None else tied.reshape(batch)
        movable = self._tensor(free)
        live = movable.any(-1)
        return Problem(
            self._tensor(rows.copy()),
            samples,
            movable,
            self._tensor(tied),
            live.any(0).nonzero()[:, 0],
            self._tensor(limits.array()),
            penalties,
        )

    def _loss(self, rows: Tensor, samples: SampleBatch, beta: float, penalties: Penalties) -> Tensor:
        """Losses (B,)."""
        total = torch.zeros(len(rows), dtype=torch.float64, device=self.device)
        for piece in samples.pieces(self._span(rows.shape[0] * rows.shape[1], FORWARD_BYTES)):
            g = distances(rows, local_points(rows, piece.points))
            field, _ = fold(g, rows, piece.background)
            residual, _, _ = residuals(field, g, rows[..., Column.SIGN] > 0, piece, beta, penalties)
            total += 0.5 * (residual * residual).sum((1, 2), dtype=torch.float64)
        return total

    def _system(
        self, rows: Tensor, samples: SampleBatch, parts: Tensor, beta: float, penalties: Penalties
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Loss (B,), J^T r (B, 15 L) and J^T J (B, 15 L, 15 L) over the L parts of that index."""
        size = len(parts) * STEP_WIDTH
        loss, gradient, matrix = (
            torch.zeros(len(rows), *shape, dtype=torch.float64, device=self.device)
            for shape in ((), (size,), (size, size))
        )
        for piece in samples.pieces(self._span(rows.shape[0] * rows.shape[1], DERIVATIVE_BYTES)):
            residual, jacobian = linearised(rows, piece, parts, beta, penalties)
            loss += 0.5 * (residual * residual).sum(1, dtype=torch.float64)
            gradient += torch.einsum("bkn,bk->bn", jacobian, residual)
            matrix += jacobian.mT @ jacobian
        return loss, gradient, matrix

    def _minimise(self, problem: Problem, stages: ArrayLike) -> tuple[Tensor, Tensor, Tensor]:
        """Rows (B, M, 17), losses (B,) and iterations (B,) after all stages of Levenberg-Marquardt."""
        loss = torch.zeros(len(problem.rows), dtype=torch.float64, device=self.device)
        iterations = torch.zeros(len(problem.rows), dtype=torch.int64, device=self.device)
        for beta, most in np.asarray(stages, np.float32):
            loss = self._stage(problem, float(beta), int(most), iterations)
        return problem.rows, loss, iterations

    def _stage(self, problem: Problem, beta: float, most: int, iterations: Tensor) -> Tensor:
        """Runs one stage on problem.rows in place, counts its iterations, and returns the losses (B,)."""
        batch = torch.arange(len(problem.rows), device=self.device)
        damping = torch.full((len(batch),), START_DAMPING, dtype=torch.float64, device=self.device)
        loss, gradient, matrix = self._tied_system(problem, batch, beta)
        running = torch.ones(len(batch), dtype=torch.bool, device=self.device)
        for iteration in range(most):
            variable = problem.variables(gradient)
            running &= variable.any(1)
            iterations += running
            before, accepted = loss.clone(), torch.zeros_like(running)
            trying = batch[running]
            for _ in range(ATTEMPTS):
                if len(trying) == 0:
                    break
                step = damped_step(matrix[trying], gradient[trying], variable[trying], damping[trying])
                candidate = problem.moved(trying, step, variable[trying])
                now = self._loss(candidate, problem.samples.of(trying), beta, problem.penalties)
                better = now < loss[trying]  # a step that could not be solved for is NaN, and never better
                won, old = trying[better], damping[trying]
                problem.rows[won], loss[won], accepted[won] = candidate[better], now[better], True
                damping[trying] = torch.where(better, (old * RELAX).clamp(min=LEAST_DAMPING), old * TIGHTEN)
                trying = trying[~better]
            running &= accepted & (before - loss >= LEAST_GAIN * before)
            going = batch[running]
            if iteration + 1 == most or len(going) == 0:
                break
            loss[going], gradient[going], matrix[going] = self._tied_system(problem, going, beta)
        return loss

    def _tied_system(self, problem: Problem, which: Tensor, beta: float) -> tuple[Tensor, Tensor, Tensor]:
        """The system of some assemblies; sx and sy of tied parts are one variable, kept in sx."""
        samples, parts = problem.samples.of(which), problem.parts
        loss, gradient, matrix = self._system(problem.rows[which], samples, parts, beta, problem.penalties)
        tied = problem.tied[which][:, parts].double()
        slope = gradient.view(len(which), len(parts), STEP_WIDTH)
        slope[..., Tangent.SX] += tied * slope[..., Tangent.SY]
        blocks = matrix.view(len(which), len(parts), STEP_WIDTH, len(parts), STEP_WIDTH)
        blocks[:, :, Tangent.SX] += tied[:, :, None, None] * blocks[:, :, Tangent.SY]
        blocks[..., Tangent.SX] += tied[:, None, None] * blocks[..., Tangent.SY]
        return loss, gradient, matrix


def _numpy(tensor: Tensor) -> Floats:
    return tensor.cpu().numpy()
