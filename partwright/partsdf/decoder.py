"""The cross-part decoder (PartSDF, section 3.2): latents and local points to the distance of every part.

Layout: (B, P, N, D) for B shapes, P parts, N points, D features, so that the parts of all shapes share one
matrix product a layer, and a cross-part layer is one product over the part axis of (B, P, N * D).
`partwright.partsdf.paper` is the plain form that tests compare with.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import torch
from torch import Tensor, nn

from partwright.partsdf.checkpointed_linear import cross_linear, linear, working_type
from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.poses import PoseTensors


class Conditioned(Protocol):
    """A decoder with its weights folded and its latents taken in: local points (B, P, N, 3) to distances
    (B, P, N), unit frame."""

    def __call__(self, local: Tensor) -> Tensor: ...


class WeightNorm(nn.Module):
    """A linear map's weight (out, in) = g v / |v|, row by row (Salimans & Kingma 2016)."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.direction = nn.Parameter(torch.empty(outputs, inputs))
        nn.init.uniform_(self.direction, -(inputs**-0.5), inputs**-0.5)  # as nn.Linear
        self.length = nn.Parameter(self.direction.detach().norm(dim=1, keepdim=True))

    def folded(self) -> Tensor:
        return self.direction * (self.length / self.direction.norm(dim=1, keepdim=True))


class SinglePart(nn.Module):
    """h_sp (eq. 3) without its activation: W x + b + W_z z_p + b_p.

    modulated: whether the latent enters; biased: whether each part has a bias of its own, at first 0.
    """

    def __init__(
        self, inputs: int, outputs: int, parts: int, latent: int, modulated: bool, biased: bool
    ) -> None:
        super().__init__()
        self.weight = WeightNorm(inputs, outputs)
        self.bias = nn.Parameter(torch.empty(outputs).uniform_(-(inputs**-0.5), inputs**-0.5))
        self.modulation = WeightNorm(latent, outputs) if modulated else None
        self.part_bias = nn.Parameter(torch.zeros(parts, outputs)) if biased else None

    def folded(self, latents: Tensor) -> tuple[Tensor, Tensor]:
        """The weight (in, out), and all that is added (B P, out), of latents (B, P, Z)."""
        offset = self.bias.expand(*latents.shape[:2], -1)
        if self.modulation is not None:
            offset = offset + latents @ self.modulation.folded().T
        if self.part_bias is not None:
            offset = offset + self.part_bias
        return self.weight.folded().T, offset.flatten(0, 1)


class CrossPart(nn.Module):
    """h_cp with its skip (eq. 4): x + ReLU(W x + b) over the part axis, the same for all features."""

    def __init__(self, parts: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(parts, parts).uniform_(-(parts**-0.5), parts**-0.5))
        self.bias = nn.Parameter(torch.empty(parts).uniform_(-(parts**-0.5), parts**-0.5))

    def then(self, layer: tuple[Tensor, Tensor], x: Tensor) -> Tensor:
        """Features (B P, N, D) through this and the folded single-part layer behind it."""
        return cross_linear(x, (self.weight, self.bias), *layer)


class Decoder(nn.Module):
    """f_theta (eq. 2): single-part layers with a cross-part layer after each hidden activation."""

    def __init__(self, parts: int, settings: DecoderSettings) -> None:
        super().__init__()
        self.parts, self.settings = parts, settings
        widths = [3 + 6 * settings.octaves, *[settings.width] * (settings.layers - 1), 1]
        last = settings.layers - 1
        self.single = nn.ModuleList(
            SinglePart(i, o, parts, settings.latent, settings.modulation or n == 0, biased=n < last)
            for n, (i, o) in enumerate(pairwise(widths))
        )
        crossing = last if settings.cross_part else 0
        self.cross = nn.ModuleList(CrossPart(parts) for _ in range(crossing))

    def condition(self, latents: Tensor, poses: PoseTensors | None = None) -> Conditioned:
        """Weight norm folded and latents (B, P, Z) taken in, once for any number of points; poses are told by
        the points alone."""
        layers = tuple(layer.folded(latents) for layer in self.single)  # type: ignore[operator]
        return _Layers(layers, tuple(self.cross), self.settings.octaves)  # type: ignore[arg-type]

    def forward(self, latents: Tensor, local: Tensor, poses: PoseTensors | None = None) -> Tensor:
        """Distances (B, P, N) of latents (B, P, Z) at local points (B, P, N, 3)."""
        return self.condition(latents)(local)


@dataclass(frozen=True)
class _Layers:
    layers: tuple[tuple[Tensor, Tensor], ...]
    cross: tuple[CrossPart, ...]
    octaves: int

    def __call__(self, local: Tensor) -> Tensor:
        first, *hidden, last = self.layers
        kind = working_type(local)
        # In full precision at both ends: half would round coordinates and distances to 1/256.
        with torch.autocast(local.device.type, enabled=False):
            x = linear(positional_encoding(local.flatten(0, 1), self.octaves), *first).to(kind).relu_()
        for number, layer in enumerate(hidden):
            x = self._behind_cross(number, layer, x).relu_()
        with torch.autocast(local.device.type, enabled=False):
            return self._behind_cross(-1, last, x.to(local.dtype)).view(local.shape[:3])

    def _behind_cross(self, number: int, layer: tuple[Tensor, Tensor], x: Tensor) -> Tensor:
        return self.cross[number].then(layer, x) if self.cross else linear(x, *layer)


def positional_encoding(local: Tensor, octaves: int) -> Tensor:
    """Local points (..., 3) with the sines and cosines of pi/2 x, pi x, 2 pi x ... behind: (..., 3 + 6 O)."""
    if not octaves:
        return local
    pitch = 0.5 * torch.pi * 2.0 ** torch.arange(octaves, dtype=local.dtype, device=local.device)
    phase = (local.unsqueeze(-1) * pitch).flatten(-2)
    return torch.cat([local, phase.sin(), phase.cos()], dim=-1)
