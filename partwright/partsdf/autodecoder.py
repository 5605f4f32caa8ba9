"""What is trained: the decoder and one latent a part of every shape (section 3.3)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.model import make_decoder
from partwright.partsdf.poses import PoseTensors, local_points


class AutoDecoder(nn.Module):
    """latents: (S, P, Z), at first N(0, s^2/Z), so that their expected squared norm is s^2, of `spread` s."""

    def __init__(self, shapes: int, parts: int, settings: DecoderSettings, spread: float = 1.0) -> None:
        super().__init__()
        self.decoder = make_decoder(parts, settings)
        start = spread * torch.randn(shapes, parts, settings.latent) / settings.latent**0.5
        self.latents = nn.Parameter(start)

    def forward(self, shapes: Tensor, points: Tensor, poses: PoseTensors) -> tuple[Tensor, Tensor]:
        """Distances (B, P, N) and latents (B, P, Z) of shapes (B,) at world points (B, N, 3)."""
        latents = self.latents[shapes]
        return self.decoder(latents, local_points(points, poses), poses), latents

    @torch.no_grad()
    def limit_latents(self) -> None:
        """Latents keep a norm of at most 1."""
        norm = self.latents.norm(dim=-1, keepdim=True)
        self.latents.div_(norm.clamp(min=1.0))
