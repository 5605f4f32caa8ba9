"""A decoder of our own: parts talk once a shape, and each is then a small network near its own cuboid.

The paper's network (`decoder`) evaluates every part at every point and mixes parts there. Here a token of
each part, made of its latent and its pose, hears of the others by self-attention, once a shape. What comes
out scales and shifts a small network that is the part's own, and sees the local point with sines and cosines
in octaves. It is asked only where the part can matter: in its room, which is its cuboid, enlarged to what
parts of training shapes need, and `REACH` around it. Farther away a part's distance is that from its room,
which is never more than the true one, and more than what losses look at. No part leaves its room.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from partwright.partsdf.checkpointed_linear import working_type
from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.decoder import positional_encoding
from partwright.partsdf.part_networks import Rooms, distances
from partwright.partsdf.poses import PoseTensors, rotation_matrices
from partwright.partsdf.segmented_linear import filled_linear, filled_up, segmented_linear

ROOM = 1.05  # times what the surfaces of training shapes need of a part's cuboid
REACH = 0.1  # around that room, unit lengths: the paper's clamp
_POSE = 3 + 9 + 3  # place, rotation matrix, logarithms of half-lengths


class LocalDecoder(nn.Module):
    """Tokens of parts, attention among them, and a modulated network a part.

    A network is `settings.layers` linear maps of `settings.width`; tokens are `settings.token` wide and go
    through `settings.blocks` pre-norm blocks of `settings.heads` heads. `cross_part` false leaves the blocks
    out, `modulation` false lets tokens into the first layer only.
    """

    room: Tensor
    unit: Tensor

    def __init__(self, parts: int, settings: DecoderSettings) -> None:
        super().__init__()
        self.parts, self.settings = parts, settings
        token, count = settings.token, settings.layers
        self.latent = nn.Linear(settings.latent, token)
        self.pose = nn.Linear(_POSE, token)
        # In place: a product of meta tensors, by which files are checked, imports much of torch: a second.
        self.part = nn.Parameter(torch.randn(parts, token).mul_(0.5))
        self.register_buffer("room", torch.full((parts, 3), 1.25))
        self.register_buffer("unit", torch.ones(parts, 3))
        self.talk = None
        if settings.cross_part and settings.blocks:
            block = nn.TransformerEncoderLayer(
                token, settings.heads, 2 * token, dropout=0.0, batch_first=True, norm_first=True
            )
            norm = nn.LayerNorm(token)
            self.talk = nn.TransformerEncoder(block, settings.blocks, norm, enable_nested_tensor=False)
        # The local point with its octaves, and the same point in unit lengths.
        widths = [3 + 6 * settings.octaves + 3, *[settings.width] * (count - 1), 1]
        self.weights = nn.ParameterList(
            torch.empty(parts, i, o).uniform_(-((6 / i) ** 0.5), (6 / i) ** 0.5) for i, o in pairwise(widths)
        )
        with torch.no_grad():
            self.weights[-1].mul_(0.2)
        # A shift a feature, and a scale where an activation follows.
        self.sizes = [o for n, o in enumerate(widths[1:]) for _ in range(2 if n < count - 1 else 1)]
        told = sum(self.sizes if settings.modulation else self.sizes[:2])
        self.modulation = nn.Linear(token, told)
        self.shift = nn.Parameter(torch.zeros(parts, sum(self.sizes) - told))
        with torch.no_grad():
            self.latent.weight.mul_(settings.latent**0.5)  # latents have norms of 1, not entries
            self.modulation.weight.mul_(0.3)
            self.modulation.bias.mul_(0.3)

    @torch.no_grad()
    def fit_room(self, needed: Tensor) -> None:
        """How far parts reach along their axes, (P, 3) in half-lengths of their cuboids, which fit and do not
        hold them."""
        self.room.copy_((ROOM * needed).clamp(min=ROOM))
        # A sheet that holds what lies deep below it has a room many times as thick as its cuboid.
        self.unit.copy_(self.room)

    def condition(self, latents: Tensor, poses: PoseTensors | None = None) -> LocalConditioned:
        """Latents (B, P, Z) and poses (B, P, ...) taken in, once for any number of points."""
        if poses is None:
            raise TypeError("a local decoder also needs the poses of the parts")
        kind = working_type(latents)
        # Tokens, a few a shape, in full precision, as both ends of the networks: half would blur places.
        with torch.autocast(latents.device.type, enabled=False):
            placed = (poses.translation, rotation_matrices(poses.rotation).flatten(-2), poses.scale.log())
            token = self.latent(latents) + self.pose(torch.cat(placed, dim=-1)) + self.part
            if self.talk is not None:
                token = self.talk(token)
            values = self.modulation(token)
            values = torch.cat([values, self.shift.expand(len(values), -1, -1)], dim=-1)
            modulations = values.split(self.sizes, dim=-1)
            layers = []
            for n, weight in enumerate(self.weights):
                shift = modulations[2 * n]
                if n < len(self.weights) - 1:  # bounded: it would run away
                    weight = weight * (1 + modulations[2 * n + 1].tanh()).unsqueeze(-2)
                else:
                    weight = weight.expand(len(values), -1, -1, -1)
                layers.append((weight.flatten(0, 1), shift.flatten(0, 1)))
        octaves = self.settings.octaves
        return LocalConditioned(
            tuple(layers), poses.scale, self.room, self.unit, octaves, kind, self.training
        )

    def forward(self, latents: Tensor, local: Tensor, poses: PoseTensors | None = None) -> Tensor:
        """Distances (B, P, N) of latents (B, P, Z) at local points (B, P, N, 3) of poses (B, P, ...)."""
        return self.condition(latents, poses)(local)


def larger(said: Tensor, room: Tensor) -> Tensor:
    """The larger of what a network says and the distance from its room; where that is the room's, and the
    loss wants more still, the network hears of it, too.

    By the true derivative it would not, and one that once says less than the room everywhere never learns
    again: thin discs, whose depth is about their room's, then stay the boxes that these are.
    """
    result: Tensor = _Larger.apply(said, room)
    return result


class _Larger(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, said: Tensor, room: Tensor) -> Tensor:
        ctx.less = said < room
        return torch.maximum(said, room)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, Tensor]:
        (by,) = gradients
        deaf = ctx.less & (by >= 0)
        return by.masked_fill(deaf, 0.0), by.masked_fill(~ctx.less, 0.0)


@dataclass(frozen=True)
class LocalConditioned:
    """layers: a weight (B P, I, O) and a shift (B P, O) each. scale: half-lengths (B, P, 3). room: (P, 3),
    and unit: (P, 3) in which the networks see places, both in half-lengths. kind: of numbers in hidden
    layers. learning: whether derivatives are those of `larger`."""

    layers: tuple[tuple[Tensor, Tensor], ...]
    scale: Tensor
    room: Tensor
    unit: Tensor
    octaves: int
    kind: torch.dtype
    learning: bool

    def of(self, part: int) -> LocalConditioned:
        """The same with the part of that number alone."""
        layers = tuple(
            (
                weight.unflatten(0, self.scale.shape[:2])[:, part],
                shift.unflatten(0, self.scale.shape[:2])[:, part],
            )
            for weight, shift in self.layers
        )
        row = slice(part, part + 1)
        return replace(
            self, layers=layers, scale=self.scale[:, row], room=self.room[row], unit=self.unit[row]
        )

    def __call__(self, local: Tensor, filled: bool | None = None) -> Tensor:
        """filled: whether segments are filled up to one length, as on a GPU; if None, by the device, and by
        the compiled kernel where it can be."""
        if filled is None and self._by_kernel(local):
            count = len(self.scale)
            rooms = Rooms(self.room.repeat(count, 1), self.unit.repeat(count, 1), REACH, self.octaves)
            found = distances(
                local.flatten(0, 1), self.scale.flatten(0, 1), self.layers, rooms, self.learning
            )
            return found.view(local.shape[:3])
        beyond = local.abs() - self.room[:, None]
        room = (beyond * self.scale.unsqueeze(-2)).amax(-1)  # the distance from it
        near = (room < REACH).flatten(0, 1)  # (B P, N)
        rows = near.flatten().nonzero().squeeze(1)
        points = local.reshape(-1, 3).index_select(0, rows)
        with torch.autocast(local.device.type, enabled=False):
            inside = self._network(points, near.sum(dim=1), rows // near.shape[1], filled)
        flat = room.flatten()
        either = larger if self.learning else torch.maximum
        return flat.index_put((rows,), either(inside, flat.index_select(0, rows))).view(room.shape)

    def _network(self, points: Tensor, counts: Tensor, owner: Tensor, filled: bool | None) -> Tensor:
        """(M,) at local points (M, 3), `counts` (B P,) of each part of each shape, which stand together."""
        unit = self.unit.expand_as(self.scale).flatten(0, 1).index_select(0, owner)
        lengths = self.scale.flatten(0, 1).index_select(0, owner)
        y = torch.cat([positional_encoding(points / unit, self.octaves), points * lengths], dim=-1)
        filled = y.is_cuda if filled is None else filled
        y = self._filled(y, counts) if filled else self._one_by_one(y, counts.cumsum(dim=0).tolist())
        return y.squeeze(1) * (lengths * unit).amin(dim=1)  # a small part's errors are small

    def _by_kernel(self, x: Tensor) -> bool:
        """Whether the kernel takes such numbers: in single precision on a CPU."""
        return self.kind == x.dtype == torch.float32 and x.device.type == "cpu"

    def _one_by_one(self, y: Tensor, ends: list[int]) -> Tensor:
        for n, (weight, shift) in enumerate(self._typed(y.dtype)):
            y = segmented_linear(y.to(weight.dtype), weight, shift, ends, n < len(self.layers) - 1)
        return y

    def _filled(self, y: Tensor, counts: Tensor) -> Tensor:
        if not len(y):
            return y[:, :1]
        place, most = filled_up(counts)
        y = y.new_zeros(len(counts) * most, y.shape[1]).index_copy(0, place, y).unflatten(0, (-1, most))
        for n, (weight, shift) in enumerate(self._typed(y.dtype)):
            y = filled_linear(y.to(weight.dtype), weight, shift, n < len(self.layers) - 1)
        return y.flatten(0, 1).index_select(0, place)

    def _typed(self, whole: torch.dtype) -> Iterator[tuple[Tensor, Tensor]]:
        """The layers, `whole` at both ends, as in `decoder`."""
        for n, (weight, shift) in enumerate(self.layers):
            kind = self.kind if 0 < n < len(self.layers) - 1 else whole
            yield weight.to(kind), shift.to(kind)
