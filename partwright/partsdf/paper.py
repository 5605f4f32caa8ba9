"""The paper's program in plain form: slow, readable, and what the fast paths are compared with.

Weight norm by torch's own parametrisation, the cross-part layer as a convolution with the parts as channels,
every layer written out, and a dense grid.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils.parametrizations import weight_norm

from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.decoder import Decoder

# The parameters of `Decoder` by the names that they have here.
_WEIGHT = "parametrizations.weight.original"
_NAMES = {
    ("single", "weight", "length"): f"linear.{{}}.{_WEIGHT}0",
    ("single", "weight", "direction"): f"linear.{{}}.{_WEIGHT}1",
    ("single", "bias"): "linear.{}.bias",
    ("single", "modulation", "length"): f"modulation.{{}}.{_WEIGHT}0",
    ("single", "modulation", "direction"): f"modulation.{{}}.{_WEIGHT}1",
    ("single", "part_bias"): "part_bias.{}",
    ("cross", "weight"): "cross.{}.weight",
    ("cross", "bias"): "cross.{}.bias",
}


class ReferenceDecoder(nn.Module):
    """The same function as `Decoder`, which has to have cross-part layers and modulation.

    Features are (B, P, N, D); the convolution sees P channels over an image of N x D.
    """

    def __init__(self, parts: int, settings: DecoderSettings) -> None:
        super().__init__()
        widths = [3, *[settings.width] * (settings.layers - 1), 1]
        self.linear = nn.ModuleList(weight_norm(nn.Linear(i, o)) for i, o in pairwise(widths))
        self.modulation = nn.ModuleList(
            weight_norm(nn.Linear(settings.latent, o, bias=False)) for o in widths[1:]
        )
        self.part_bias = nn.ParameterList(torch.zeros(parts, o) for o in widths[1:-1])
        self.cross = nn.ModuleList(nn.Conv2d(parts, parts, 1) for _ in widths[1:-1])

    def load(self, decoder: Decoder) -> ReferenceDecoder:
        """Take the weights of a `Decoder`."""
        state = {}
        for name, value in decoder.state_dict().items():
            kind, number, *rest = name.split(".")
            key = _NAMES[(kind, *rest)].format(number)
            state[key] = value[:, :, None, None] if key.startswith("cross") and value.ndim == 2 else value
        self.load_state_dict(state)
        return self

    def forward(self, latents: Tensor, local: Tensor) -> Tensor:
        """Distances (B, P, N) of latents (B, P, Z) at local points (B, P, N, 3)."""
        x = local
        for n, linear in enumerate(self.linear):
            x = linear(x) + self.modulation[n](latents)[:, :, None]
            if n < len(self.cross):
                x = torch.relu(x + self.part_bias[n][:, None])
                x = x + torch.relu(self.cross[n](x))
        return x.squeeze(-1)


def dense_grid(resolution: int) -> np.ndarray:
    """(R, R, R, 3) float32 places of the corners of a grid over [-1, 1]^3."""
    axis = np.linspace(-1.0, 1.0, resolution, dtype=np.float32)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
