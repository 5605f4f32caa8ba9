"""The three CSG layers (section 3.2), on tensors: a batch B, n points, p primitives, c convexes.

Inside is 0 for what is marked with a star in the paper, 1 for what is marked with a plus.
"""

from __future__ import annotations

from typing import Any, cast

import torch
from torch import Tensor

LEAK = 1e-3  # share of the gradient that passes the clamp from outside [0, 1], where it leads back
ALPHA = 0.2  # eq. 5, section 4.1


class _Leaking(torch.autograd.Function):
    """Values clipped to [0, high], or to at least 0, whose gradient is that of torch's clamp or relu."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, high: float | None) -> Tensor:
        ctx.save_for_backward(x)
        ctx.high = high
        return x.clamp(0, high)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        (x,), (gradient,) = ctx.saved_tensors, gradients
        within = x > 0 if ctx.high is None else (x >= 0) & (x <= ctx.high)
        back = ~within & ((gradient > 0) == (x > 0))
        return gradient * (within + LEAK * back), None


def clamp(x: Tensor) -> Tensor:
    """The clip C of eq. 4 to [0, 1]. Values outside still get `LEAK` of a gradient that leads them back."""
    return cast(Tensor, _Leaking.apply(x, 1.0))


def positive(x: Tensor) -> Tensor:
    """The relu of eq. 2, with `LEAK` of a gradient that leads negative values back."""
    return cast(Tensor, _Leaking.apply(x, None))


def intersection(distance: Tensor, selection: Tensor, leaks: bool = False) -> Tensor:
    """Eq. 2: C = relu(D) T, (B, n, c), 0 inside; D (B, n, p), T (p, c) or (B, p, c).

    leaks: so that a point deep inside a convex where nothing should be teaches its primitives, by `positive`.
    """
    return (positive(distance) if leaks else distance.relu()) @ selection


def union_exact(convexes: Tensor) -> Tensor:
    """Eq. 3: a* = min_i C, (B, n), 0 inside; of the convexes of one side (B, n, c/2)."""
    return convexes.amin(dim=-1)


def union_weighted(convexes: Tensor, weights: Tensor) -> Tensor:
    """Eq. 4: a+ = C(sum_i W_i C(1 - C_i)), (B, n), about 1 inside; every convex gets a gradient."""
    return clamp((clamp(1 - convexes) * weights).sum(dim=-1))


def difference_exact(left: Tensor, right: Tensor) -> Tensor:
    """Eq. 5: s* = max(a_l*, alpha - a_r*), 0 inside."""
    return left.maximum(ALPHA - right)


def difference_weighted(left: Tensor, right: Tensor) -> Tensor:
    """Eq. 6: s+ = min(a_l+, 1 - a_r+), 1 inside."""
    return left.minimum(1 - right)
