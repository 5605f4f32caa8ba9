"""The local decoder's networks by the compiled kernel: single precision on a CPU.

A part's points go through all its layers while they stay in the cache. By PyTorch, an operation a part and
layer takes longer than its product, as there are only a few hundred points; and derivatives are carried back
only where a loss has any: it sees one part of a point, or two, where several are near.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from partwright import _kernel

Layers = Sequence[tuple[Tensor, Tensor]]


class Rooms(NamedTuple):
    """Of G parts: how far their surfaces may reach along their axes, room (G, 3), and the unit (G, 3) that
    networks see places in, both in half-lengths; how far around a room its part is asked; octaves."""

    room: Tensor
    unit: Tensor
    reach: float
    octaves: int


def distances(local: Tensor, scale: Tensor, layers: Layers, rooms: Rooms, learning: bool = False) -> Tensor:
    """(G, N) at local points (G, N, 3) of G parts with half-lengths `scale` (G, 3): what `local._Local` says.

    layers: a weight (G, I, O) and a shift (G, O) each. learning: derivatives are those of `local.larger`.
    Differentiable once.
    """
    parameters = (t for layer in layers for t in layer)
    result: Tensor = _Distances.apply(local, scale, rooms, learning, *parameters)
    return result


class _Distances(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, local: Tensor, scale: Tensor, rooms: Rooms, learning: bool, *layers: Tensor
    ) -> Tensor:
        ctx.save_for_backward(local, scale, *layers)
        ctx.rooms, ctx.learning = rooms, learning
        return torch.from_numpy(_kernel.networks_distances(**_arguments(local, scale, rooms, layers)))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        local, scale, *layers = ctx.saved_tensors
        by_local, by_scale, by_weight, by_shift = _kernel.networks_gradients(
            **_arguments(local, scale, ctx.rooms, layers),
            upstream=_array(gradients[0]),
            learning=ctx.learning,
        )
        each = [torch.from_numpy(t) for pair in zip(by_weight, by_shift, strict=True) for t in pair]
        return torch.from_numpy(by_local), torch.from_numpy(by_scale), None, None, *each


def _arguments(local: Tensor, scale: Tensor, rooms: Rooms, layers: Sequence[Tensor]) -> dict[str, Any]:
    return {
        "local": _array(local),
        "weights": [_array(t) for t in layers[::2]],
        "shifts": [_array(t) for t in layers[1::2]],
        "scale": _array(scale),
        "room": _array(rooms.room),
        "unit": _array(rooms.unit),
        "reach": rooms.reach,
        "octaves": rooms.octaves,
        "threads": torch.get_num_threads(),
    }


def _array(t: Tensor) -> np.ndarray:
    """The tensor's numbers, in the order of its axes."""
    return t.detach().contiguous().numpy()
