"""A cross-part layer and the linear map behind it as one step, of which only the input is kept for backward.

Autograd would keep three tensors a layer: what goes into the cross-part layer, what comes out of its ReLU,
and their sum. A cross-part layer costs next to nothing beside the product behind it, so backward computes it
again from its input, which is also what the ReLU in front of it keeps.

Features are (B P, N, D): the parts of one shape behind one another.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable


def linear(x: Tensor, weight: Tensor, offset: Tensor) -> Tensor:
    """x W + o of x (B P, N, D), W (D, E), o (B P, E): the product and the sum in one pass."""
    kind = working_type(x)
    return torch.baddbmm(offset.to(kind)[:, None], x.to(kind), weight.to(kind).expand(len(x), -1, -1))


def cross_linear(x: Tensor, cross: tuple[Tensor, Tensor], weight: Tensor, offset: Tensor) -> Tensor:
    """y W + o of y = x + ReLU(C x + c): h_cp with its skip, then h_sp without its activation (eq. 3-4).

    Args:
        x: features (B P, N, D).
        cross: C (P, P) and c (P,), over the part axis.
        weight: W (D, E).
        offset: o (B P, E), of bias, latent and part.

    Returns:
        (B P, N, E), with first derivatives only.
    """
    kind = working_type(x)
    result: Tensor = _CrossLinear.apply(*(tensor.to(kind) for tensor in (x, *cross, weight, offset)))
    return result


def working_type(x: Tensor) -> torch.dtype:
    """What autocast asks for where it is on, else the type of x."""
    kind = x.device.type
    return torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else x.dtype


class _CrossLinear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor, mix: Tensor, bias: Tensor, weight: Tensor, offset: Tensor) -> Tensor:
        ctx.save_for_backward(x, mix, bias, weight)
        return linear(_crossed(x, mix, bias).add_(x), weight, offset)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        with torch.autocast(gradient.device.type, enabled=False):
            return _gradients(gradient, ctx.saved_tensors, ctx.needs_input_grad)


def _gradients(
    gradient: Tensor, saved: tuple[Tensor, ...], needed: tuple[bool, ...]
) -> tuple[Tensor | None, ...]:
    """Of x, C, c, W and o, those that are needed; `gradient` is the output's (B P, N, E)."""
    x, mix, bias, weight = saved
    for_x, for_mix, for_bias, for_weight, for_offset = needed
    to_x = to_mix = to_bias = to_weight = to_offset = None
    if for_offset:
        to_offset = gradient.sum(dim=1)
    to_y = gradient @ weight.T
    through = _crossed(x, mix, bias)
    inner = _by_part(torch.ops.aten.threshold_backward(to_y, through, 0), mix)  # of C x + c
    if for_weight:
        to_weight = through.add_(x).flatten(0, 1).T @ gradient.flatten(0, 1)
    if for_mix:
        to_mix = (inner @ _by_part(x, mix).mT).sum(dim=0)
    if for_bias:
        to_bias = inner.sum(dim=(0, 2))
    if for_x:
        to_x = _by_part(to_y, mix).baddbmm_(mix.T.expand(len(inner), -1, -1), inner).view_as(x)
    return to_x, to_mix, to_bias, to_weight, to_offset


def _crossed(x: Tensor, mix: Tensor, bias: Tensor) -> Tensor:
    """ReLU(C x + c), over the part axis."""
    parts = _by_part(x, mix)
    mixed = torch.baddbmm(bias[:, None], mix.expand(len(parts), -1, -1), parts)
    return mixed.relu_().view_as(x)


def _by_part(x: Tensor, mix: Tensor) -> Tensor:
    """(B P, N, D) as (B, P, N D)."""
    return x.view(len(x) // len(mix), len(mix), x.shape[1] * x.shape[2])
