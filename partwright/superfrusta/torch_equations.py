"""The equations of a batch of fits in PyTorch: folds, residuals, derivatives, steps, and moves in bounds.

Rows are (B, M, 17): B assemblies of M parts, each with P samples. `torch_kernel` runs them on a device; the
compiled counterparts are cpp/normal_equations.cpp and cpp/optimise.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from partwright.fields import reference
from partwright.fields.columns import (
    PROPORTIONS,
    ROTATION,
    ROTATION_STEP,
    SHAPE,
    SHAPE_STEP,
    SIZE,
    STEP_WIDTH,
    TRANSLATION,
    TRANSLATION_STEP,
    Column,
    Tangent,
)
from partwright.fields.kernel import Penalties
from partwright.fields.operations import SHARP
from partwright.fields.reference import FAR
from partwright.fields.superfrustum import tightest_bulge

# A pair whose residuals move less than this per unit of distance takes no part in a step.
NEGLIGIBLE = 1e-6
# As in cpp/optimise.cpp.
DAMPING_FLOOR, RIDGE = 1e-3, 1e-9


@dataclass(frozen=True)
class SampleBatch:
    """What B fits compare with: points (B, P, 3), distance, weight and, if any, background (B, P)."""

    points: Tensor
    distance: Tensor
    weight: Tensor
    background: Tensor | None

    def of(self, which: Tensor) -> SampleBatch:
        """The samples of the assemblies of that index."""
        if len(which) == len(self.points):
            return self
        behind = None if self.background is None else self.background[which]
        return SampleBatch(self.points[which], self.distance[which], self.weight[which], behind)

    def pieces(self, span: int) -> Iterator[SampleBatch]:
        """The samples in spans of so many points."""
        for first in range(0, self.points.shape[1], span):
            part = slice(first, first + span)
            behind = None if self.background is None else self.background[:, part]
            yield SampleBatch(self.points[:, part], self.distance[:, part], self.weight[:, part], behind)


@dataclass(frozen=True)
class Problem:
    """B assemblies in the course of a fit.

    rows (B, M, 17) change in place. free (B, M, 15) and tied (B, M) as in the kernel; `parts` (L,) is the
    index of those that move in any assembly; limits (3, 15): lower and upper bounds, longest steps.
    """

    rows: Tensor
    samples: SampleBatch
    free: Tensor
    tied: Tensor
    parts: Tensor
    limits: Tensor
    penalties: Penalties

    def variables(self, gradient: Tensor) -> Tensor:
        """Entries (B, 15 L) that the next step may move: at a bound, only those that want back inside."""
        lower, upper, _ = self.limits[:, SHAPE_STEP]
        value = self.rows[:, self.parts, SHAPE]
        slope = gradient.view(len(self.rows), len(self.parts), STEP_WIDTH)[..., SHAPE_STEP]
        leaving = ((value <= lower) & (slope > 0)) | ((value >= upper) & (slope < 0))
        variable = self.free[:, self.parts].clone()
        variable[..., SHAPE_STEP] &= ~leaving
        variable[..., Tangent.SY] &= ~self.tied[:, self.parts]
        return variable.flatten(1)

    def moved(self, which: Tensor, step: Tensor, variable: Tensor) -> Tensor:
        """Rows (n, M, 17) of the assemblies of that index after steps (n, 15 L), clipped, within bounds.

        Entries that are not `variable` (n, 15 L) keep their bits.
        """
        rows = self.rows[which]
        delta = step.new_zeros(*rows.shape[:2], STEP_WIDTH)
        delta[:, self.parts] = step.view(len(which), -1, STEP_WIDTH)
        moving = torch.zeros_like(delta, dtype=torch.bool)
        moving[:, self.parts] = variable.view(len(which), -1, STEP_WIDTH)
        lower, upper, longest = self.limits
        clipped = delta.clamp(-longest.double(), longest.double())
        old = rows[..., SHAPE]
        shape = (old + clipped[..., SHAPE_STEP].float()).clamp(lower[SHAPE_STEP], upper[SHAPE_STEP])
        shape = torch.where(moving[..., SHAPE_STEP], shape, old)
        rotation = turned(rows[..., ROTATION], clipped[..., ROTATION_STEP])
        place = rows[..., TRANSLATION] + clipped[..., TRANSLATION_STEP].float()
        moved = torch.cat([place, rotation, shape, rows[..., Column.SIGN :]], -1)
        together = self.tied[which] & moving[..., Tangent.SX]
        moved[..., Column.SY] = torch.where(together, moved[..., Column.SX], moved[..., Column.SY])
        tightest = tightest_bulge(moved[..., Column.SX], moved[..., Column.SZ])
        bulge = torch.minimum(moved[..., Column.BULGE], tightest)
        moved[..., Column.BULGE] = torch.where(moving[..., Tangent.BULGE], bulge, moved[..., Column.BULGE])
        return moved


def turned(rotation: Tensor, vector: Tensor) -> Tensor:
    """Quaternions (..., 4) after R <- R exp(vector), vector (..., 3) in float64; the same where it is 0."""
    angle = vector.norm(dim=-1, keepdim=True)
    small = angle <= 1e-9
    ratio = torch.where(small, 0.5, (angle / 2).sin() / torch.where(small, 1.0, angle))
    a, v = rotation.double(), ratio * vector
    c, scalar, imaginary = (angle / 2).cos(), a[..., :1], a[..., 1:]
    product = torch.cat(
        [
            scalar * c - (imaginary * v).sum(-1, keepdim=True),
            scalar * v + c * imaginary + torch.linalg.cross(imaginary, v),
        ],
        -1,
    )
    product = product / product.norm(dim=-1, keepdim=True)
    return torch.where(angle > 0, product.float(), rotation)


def damped_step(matrix: Tensor, gradient: Tensor, variable: Tensor, damping: Tensor) -> Tensor:
    """Levenberg-Marquardt steps (n, V): zero where not `variable`, NaN where the matrix cannot be factored.

    The floor keeps parameters without influence in place.
    """
    diagonal = matrix.diagonal(dim1=1, dim2=2)
    extra = damping[:, None] * (diagonal + DAMPING_FLOOR) + RIDGE
    both = variable[:, :, None] & variable[:, None, :]
    damped = torch.where(both, matrix, 0.0) + torch.diag_embed(torch.where(variable, extra, 1.0))
    factor, failed = torch.linalg.cholesky_ex(damped)
    step = torch.cholesky_solve(torch.where(variable, -gradient, 0.0)[..., None], factor)[..., 0]
    return torch.where((failed == 0)[:, None], step, torch.nan)


def local_points(rows: Tensor, points: Tensor) -> Tensor:
    """Points (B, P, 3) in the frame of each part of rows (B, M, 17): (B, M, P, 3)."""
    return reference.rotate_to_local(points[:, None], rows[..., TRANSLATION], rows[..., ROTATION])


def distances(rows: Tensor, local: Tensor) -> Tensor:
    """Distances (B, M, P) of each part alone at its local points (B, M, P, 3)."""
    return reference.superfrustum(local, rows[..., SIZE], *rows[..., PROPORTIONS].unbind(-1))


def fold_step(field: Tensor, g: Tensor, blend: Tensor, sign: Tensor) -> tuple[Tensor, Tensor]:
    """The fold so far joined with the next part as its sign says, and the weight of what came before.

    That is the derivative by the fold so far; the one by g is the sign times what is left of 1.
    """
    before = sign * field
    radius = blend.clamp(min=SHARP)
    smooth = (0.5 + (g - before) / (2 * radius)).clamp(0, 1)
    weight = torch.where(blend > SHARP, smooth, (before <= g).to(g))
    return sign * (g + (before - g) * weight - blend * weight * (1 - weight)), weight


def fold(g: Tensor, rows: Tensor, background: Tensor | None) -> tuple[Tensor, Tensor]:
    """Distances (B, M, P) of parts (B, M, 17) joined, after the background, if any: (B, P).

    Also the weights (B, M, P) with which what came before each part goes on.
    """
    blends, signs = rows[..., Column.BLEND, None], rows[..., Column.SIGN, None]
    weights = torch.zeros_like(g)
    field = background
    if field is None:
        field = torch.where(signs[:, 0] > 0, g[:, 0], FAR)
        weights[:, 0] = (signs[:, 0] < 0).to(g)
    for part in range(background is None, g.shape[1]):
        field, weights[:, part] = fold_step(field, g[:, part], blends[:, part], signs[:, part])
    return field, weights


def fold_without(g: Tensor, rows: Tensor) -> Tensor:
    """Distances (M + 1, n) of the fold of (M, n) without each of the parts (M, 17) in turn, and of all."""
    parts = len(g)
    field = torch.full((parts + 1, g.shape[1]), FAR, dtype=g.dtype, device=g.device)
    for part in range(parts):
        joined, _ = fold_step(field, g[part], rows[part, Column.BLEND], rows[part, Column.SIGN])
        empty = field == FAR
        joined = torch.where(empty, torch.where(rows[part, Column.SIGN] > 0, g[part], FAR), joined)
        joined[part] = field[part]
        field = joined
    return field


def residuals(
    field: Tensor, g: Tensor, added: Tensor, samples: SampleBatch, beta: float, penalties: Penalties
) -> tuple[Tensor, Tensor, Tensor]:
    """Residuals (B, S, P), their derivatives by the assembly's distance, and by the occupancy of any part.

    The reconstruction against a soft target (eq. 7), then the penalties of eq. 8 that weigh anything. Those
    look at parts that are `added` (B, M), and so does the derivative by the occupancy.
    """
    root = samples.weight.sqrt()
    whole = torch.sigmoid(-beta * field)
    slope = -beta * whole * (1 - whole)
    none = torch.zeros_like(root)
    kinds = [(root * (whole - torch.sigmoid(-beta * samples.distance)), root * slope, none)]
    if penalties.overlap > 0 or penalties.blending > 0:
        total = (torch.sigmoid(-beta * g) * added[..., None]).sum(1)
        if samples.background is not None:
            total = total + torch.sigmoid(-beta * samples.background)
    if penalties.overlap > 0:
        factor = torch.where(total > 1, root * math.sqrt(penalties.overlap), 0.0)
        kinds.append((factor * (total - 1), none, factor))
    if penalties.blending > 0:
        excess = whole - total.clamp(max=1)
        factor = torch.where(excess > 0, root * math.sqrt(penalties.blending), 0.0)
        kinds.append((factor * excess, factor * slope, torch.where(total < 1, -factor, 0.0)))
    residual, by_field, by_part = (torch.stack(column, 1) for column in zip(*kinds, strict=True))
    return residual, by_field, by_part


def linearised(
    rows: Tensor, samples: SampleBatch, parts: Tensor, beta: float, penalties: Penalties
) -> tuple[Tensor, Tensor]:
    """Residuals (B, S P) and their Jacobian (B, S P, 15 L) by the L parts of that index."""
    local = local_points(rows, samples.points)
    g = distances(rows, local)
    field, weights = fold(g, rows, samples.background)
    added = rows[..., Column.SIGN] > 0
    residual, by_field, by_part = residuals(field, g, added, samples, beta, penalties)

    later = torch.cat([weights[:, 1:], torch.ones_like(weights[:, :1])], 1).flip(1).cumprod(1).flip(1)
    share = (rows[..., Column.SIGN, None] * (1 - weights) * later)[:, parts]  # dF/dg
    by_blend = -share * weights[:, parts]
    occupancy = torch.sigmoid(-beta * g[:, parts])
    slope = beta * occupancy * (1 - occupancy) * added[:, parts, None]
    by_distance = by_field[:, :, None] * share[:, None] - by_part[:, :, None] * slope[:, None]  # (B, S, L, P)

    batch, kinds, points = residual.shape
    jacobian = rows.new_zeros(batch, kinds, points, len(parts), STEP_WIDTH)
    jacobian[..., Tangent.BLEND] = (by_field[:, :, None] * by_blend[:, None]).mT
    b, part, p = (by_distance.abs().amax(1) > NEGLIGIBLE).nonzero().unbind(1)
    pair = derivatives(rows[b, parts[part]], local[b, parts[part], p])
    jacobian[b, :, p, part, : Tangent.BLEND] = by_distance[b, :, part, p][..., None] * pair[:, None]
    return residual.flatten(1), jacobian.view(batch, kinds * points, -1)


def derivatives(rows: Tensor, local: Tensor) -> Tensor:
    """Derivatives (K, 14) of the distances of K parts (K, 17), each at one local point (K, 3).

    Every pair owns its leaves, so that one reverse pass over the sum gives all of them.
    """
    with torch.enable_grad():
        leaves = [
            leaf.detach().clone().requires_grad_() for leaf in (local, rows[:, SIZE], *rows[:, PROPORTIONS].T)
        ]
        total = reference.superfrustum(leaves[0][:, None], *leaves[1:]).sum()
        slope, size, *scalars = torch.autograd.grad(total, leaves)
    identity = torch.eye(3, dtype=rows.dtype, device=rows.device)
    rotation = reference.rotate_to_local(identity, torch.zeros_like(rows[:, TRANSLATION]), rows[:, ROTATION])
    translation = -(rotation * slope[:, None]).sum(-1)
    return torch.cat([translation, torch.linalg.cross(slope, local), size, torch.stack(scalars, 1)], 1)
