"""One matrix product a segment of rows: each part of each shape has weights of its own.

On a CPU the rows of a segment, a few hundred, stay in the cache from its product to its activation.
Autograd's own way, gathering each row's shift and scale, would move several times as much memory as the
products need. On a GPU hundreds of small products are hundreds of launches, so segments are filled up to the
longest there, and multiplied in one.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

LEAK = 0.1  # of the activations


def filled_up(counts: Tensor) -> tuple[Tensor, int]:
    """Where rows lie, (M,), once segments of `counts` (G,) rows, one after another, are all as long as the
    longest; and how long that is."""
    most = int(counts.max())
    segment = torch.repeat_interleave(torch.arange(len(counts), device=counts.device), counts)
    first = counts.cumsum(0) - counts
    row = torch.arange(len(segment), device=counts.device) - first[segment]
    return segment * most + row, most


def filled_linear(x: Tensor, weight: Tensor, shift: Tensor, activated: bool = False) -> Tensor:
    """As `segmented_linear`, of rows (G, most, I) that are filled up: (G, most, O)."""
    y = torch.baddbmm(shift[:, None], x, weight)
    return torch.nn.functional.leaky_relu(y, LEAK) if activated else y


def segmented_linear(
    x: Tensor, weight: Tensor, shift: Tensor, ends: list[int], activated: bool = False
) -> Tensor:
    """Rows (M, I) of G segments, the last of each before `ends` (G,), times weights (G, I, O), plus shifts
    (G, O); then a leaky ReLU if `activated`: (M, O)."""
    result: Tensor = _SegmentedLinear.apply(x, weight, shift, ends, activated)
    return result


class _SegmentedLinear(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, x: Tensor, weight: Tensor, shift: Tensor, ends: list[int], activated: bool
    ) -> Tensor:
        y = x.new_empty(len(x), weight.shape[2])
        for g, (first, last) in enumerate(pairwise([0, *ends])):
            if last > first:
                out = y[first:last]
                torch.addmm(shift[g], x[first:last], weight[g], out=out)
                if activated:
                    torch.nn.functional.leaky_relu_(out, LEAK)
        ctx.save_for_backward(x, weight, y if activated else None)
        ctx.ends = ends
        return y

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        x, weight, y = ctx.saved_tensors
        wanted = ctx.needs_input_grad
        to_x = torch.empty_like(x) if wanted[0] else None
        to_weight = torch.zeros_like(weight, memory_format=torch.contiguous_format) if wanted[1] else None
        to_shift = weight.new_zeros(len(weight), weight.shape[2]) if wanted[2] else None
        for g, (first, last) in enumerate(pairwise([0, *ctx.ends])):
            if last == first:
                continue
            some = gradients[0][first:last]
            if y is not None:
                some = torch.ops.aten.leaky_relu_backward(some, y[first:last], LEAK, True)
            if to_x is not None:
                torch.mm(some, weight[g].T, out=to_x[first:last])
            if to_weight is not None:
                torch.mm(x[first:last].T, some, out=to_weight[g])
            if to_shift is not None:
                torch.sum(some, dim=0, out=to_shift[g])
        return to_x, to_weight, to_shift, None, None
