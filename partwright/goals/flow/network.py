"""A network that predicts the pressure on a body and its drag from points of its surface.

Points with normals, neighbours by distance, and the mean of what neighbours say (GraphSAGE, Hamilton et al.
2017, as in PartSDF, eq. 10), with the mean over the whole body beside it. The drag is the sum of the
predicted pressures against the flow, and what a second head adds for friction and what points miss: with the
pressures as targets, too, a body teaches a thousand numbers instead of one.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

POINTS = 1024
_DROPPED = 0.2  # of the last features, while learning: bodies to learn from are few
_NEIGHBOURS = 8
_OCTAVES = 2
INPUTS = 3 + 3 + 6 * _OCTAVES


class DragNetwork(nn.Module):
    """From points (B, N, 3), in units of the training's mean length, and unit normals (B, N, 3)."""

    def __init__(self, width: int = 32, layers: int = 3) -> None:
        super().__init__()
        self.width, self.layers = width, layers
        self.first = nn.Sequential(nn.Linear(INPUTS, width), nn.SiLU())
        self.mixing = nn.ModuleList(
            nn.Sequential(nn.Linear(3 * width, width), nn.SiLU(), nn.Linear(width, width))
            for _ in range(layers)
        )
        self.pressure = nn.Sequential(
            nn.Dropout(_DROPPED), nn.Linear(2 * width, width), nn.SiLU(), nn.Linear(width, 1)
        )
        self.rest = nn.Sequential(nn.Dropout(_DROPPED), nn.Linear(width, 1))

    def forward(
        self, points: Tensor, normals: Tensor, near: Tensor | None = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Pressure coefficients (B, N), what the drag coefficient has beside them (B,), embeddings (B, W).

        near: as of `neighbours`, where it is known.
        """
        near = neighbours(points) if near is None else near
        count, width = points.shape[1], self.width
        flat = (near + count * torch.arange(len(points))[:, None, None]).reshape(-1)
        waves = [f(2.0**k * torch.pi * points) for k in range(_OCTAVES) for f in (torch.sin, torch.cos)]
        h = self.first(torch.cat([points, normals, *waves], dim=-1))
        for mix in self.mixing:
            around = h.reshape(-1, width).index_select(0, flat).reshape(*near.shape, width).mean(dim=2)
            whole = h.mean(dim=1, keepdim=True).expand_as(h)
            h = h + mix(torch.cat([h, around, whole], dim=-1))
        whole = h.mean(dim=1)
        beside = whole[:, None].expand_as(h)
        return self.pressure(torch.cat([h, beside], dim=-1)).squeeze(-1), self.rest(whole).squeeze(-1), whole


def neighbours(points: Tensor) -> Tensor:
    """(B, N, K) which are the nearest to each of the points (B, N, 3), itself among them."""
    with torch.no_grad():
        return torch.cdist(points, points).topk(_NEIGHBOURS, largest=False).indices
