"""A decoder of our own: parts talk once a shape, and each is then a small network near its own cuboid.

The paper's network (`decoder`) evaluates every part at every point and mixes parts there. Here a token of
each part, made of its latent and its pose, hears of the others by self-attention, once a shape. What comes
out modulates a small network, which sees the local point with sines and cosines in octaves, and which is
asked only where the part can matter: in its room, which is its cuboid, enlarged to what parts of training
shapes need, and `REACH` around it. Farther away a part's distance is that from its room, which is never
more than the true one, and more than what losses look at. No part leaves its room.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn

from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.decoder import Conditioned, positional_encoding
from partwright.partsdf.poses import PoseTensors, rotation_matrices

ROOM = 1.05  # times what the surfaces of training shapes need of a part's cuboid
REACH = 0.1  # around that room, unit lengths: the paper's clamp
LEAK = 0.1  # of the activations
_POSE = 3 + 9 + 3  # place, rotation matrix, logarithms of half-lengths


class LocalDecoder(nn.Module):
    """Tokens of parts, attention among them, and one modulated network for all.

    The network is `settings.layers` linear maps of `settings.width`; tokens are `settings.token` wide and go
    through `settings.blocks` pre-norm blocks of `settings.heads` heads. `cross_part` false leaves the blocks
    out, `modulation` false lets tokens into the first layer only.
    """

    room: Tensor

    def __init__(self, parts: int, settings: DecoderSettings) -> None:
        super().__init__()
        self.parts, self.settings = parts, settings
        token, count = settings.token, settings.layers
        self.latent = nn.Linear(settings.latent, token)
        self.pose = nn.Linear(_POSE, token)
        self.part = nn.Parameter(0.5 * torch.randn(parts, token))
        self.register_buffer("room", torch.full((parts, 3), 1.25))
        self.talk = None
        if settings.cross_part and settings.blocks:
            block = nn.TransformerEncoderLayer(
                token, settings.heads, 2 * token, dropout=0.0, batch_first=True, norm_first=True
            )
            norm = nn.LayerNorm(token)
            self.talk = nn.TransformerEncoder(block, settings.blocks, norm, enable_nested_tensor=False)
        # The local point with its waves, and the same point in unit lengths.
        widths = [3 + 6 * settings.octaves + 3, *[settings.width] * (count - 1), 1]
        self.weights = nn.ParameterList(
            torch.empty(i, o).uniform_(-((6 / i) ** 0.5), (6 / i) ** 0.5) for i, o in pairwise(widths)
        )
        with torch.no_grad():
            self.weights[-1].mul_(0.2)
        # A shift a feature, and a scale where an activation follows.
        self.sizes = [o for n, o in enumerate(widths[1:]) for _ in range(2 if n < count - 1 else 1)]
        self.modulation = nn.Linear(token, sum(self.sizes if settings.modulation else self.sizes[:2]))
        self.shift = nn.Parameter(torch.zeros(0 if settings.modulation else sum(self.sizes[2:])))
        with torch.no_grad():
            self.modulation.weight.mul_(0.3)
            self.modulation.bias.mul_(0.3)

    @torch.no_grad()
    def fit_room(self, needed: Tensor) -> None:
        """How far parts reach along their axes, (P, 3) in half-lengths of their cuboids, which fit and do not
        hold them."""
        self.room.copy_((ROOM * needed).clamp(min=ROOM))

    def condition(self, latents: Tensor, poses: PoseTensors | None = None) -> Conditioned:
        """Latents (B, P, Z) and poses (B, P, ...) taken in, once for any number of points."""
        if poses is None:
            raise TypeError("a local decoder also needs the poses of the parts")
        placed = (poses.translation, rotation_matrices(poses.rotation).flatten(-2), poses.scale.log())
        token = self.latent(latents) + self.pose(torch.cat(placed, dim=-1)) + self.part
        if self.talk is not None:
            token = self.talk(token)
        with torch.autocast(latents.device.type, enabled=False):
            values = self.modulation(token.to(latents.dtype)).flatten(0, 1)
        values = torch.cat([values, self.shift.expand(len(values), -1)], dim=1)
        return _Local(
            tuple(self.weights),
            values.split(self.sizes, dim=1),
            poses.scale,
            self.room,
            self.settings.octaves,
        )

    def forward(self, latents: Tensor, local: Tensor, poses: PoseTensors | None = None) -> Tensor:
        """Distances (B, P, N) of latents (B, P, Z) at local points (B, P, N, 3) of poses (B, P, ...)."""
        return self.condition(latents, poses)(local)


@dataclass(frozen=True)
class _Local:
    """modulations: (B P, W) each, a shift and a scale a layer; scale: half-lengths (B, P, 3).
    room: (P, 3)."""

    weights: tuple[Tensor, ...]
    modulations: tuple[Tensor, ...]
    scale: Tensor
    room: Tensor
    octaves: int

    def __call__(self, local: Tensor) -> Tensor:
        beyond = local.abs() - self.room[:, None]
        room = (beyond * self.scale.unsqueeze(-2)).amax(-1)  # the distance from it
        near = (room < REACH).flatten(0, 1)  # (B P, N)
        rows = near.flatten().nonzero().squeeze(1)
        owner = rows // near.shape[1]
        points = local.reshape(-1, 3).index_select(0, rows)
        inside = self._network(points, owner)
        flat = room.flatten()
        return flat.index_put((rows,), torch.maximum(inside, flat.index_select(0, rows))).view(room.shape)

    def _network(self, points: Tensor, owner: Tensor) -> Tensor:
        """(M,) of pairs: local points (M, 3), and which row of the modulations (M,) is theirs."""
        lengths = self.scale.flatten(0, 1).index_select(0, owner)
        x = torch.cat([positional_encoding(points, self.octaves), points * lengths], dim=-1)
        modulations = iter(self.modulations)
        for weight in self.weights[:-1]:
            x = x @ weight
            shift, scale = next(modulations), next(modulations).tanh()  # bounded: it would run away
            shift, scale = shift.index_select(0, owner), scale.index_select(0, owner)
            x = nn.functional.leaky_relu(torch.addcmul(x + shift, x, scale), LEAK)
        x = x @ self.weights[-1] + next(modulations).index_select(0, owner)
        return x.squeeze(1).to(points.dtype) * lengths.amin(dim=1)  # a small part's errors are small
