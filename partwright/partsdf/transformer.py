"""The decoder of Table 7: self-attention over the parts instead of cross-part layers (appendix C)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.decoder import Conditioned
from partwright.partsdf.poses import PoseTensors


class TransformerDecoder(nn.Module):
    """Every point sees P tokens, one a part: local point, latent and the part's own embedding.

    The paper gives no details beyond 4.8 M parameters. Ours: an embedding, pre-norm blocks of attention and
    an MLP of twice the width, as many as `layers` less input and output allow at two linear maps each.
    """

    def __init__(self, parts: int, settings: DecoderSettings) -> None:
        super().__init__()
        self.parts, self.settings = parts, settings
        width = settings.width
        self.point = nn.Linear(3, width)
        self.latent = nn.Linear(settings.latent, width, bias=False)
        self.part = nn.Parameter(torch.zeros(parts, width))
        block = nn.TransformerEncoderLayer(
            width, settings.heads, 2 * width, dropout=0.0, batch_first=True, norm_first=True
        )
        count = max(1, (settings.layers - 2) // 2)
        norm = nn.LayerNorm(width)
        self.blocks = nn.TransformerEncoder(block, count, norm, enable_nested_tensor=False)
        self.out = nn.Linear(width, 1)

    def condition(self, latents: Tensor, poses: PoseTensors | None = None) -> Conditioned:
        """Latents (B, P, Z) taken in, for any number of points; poses are told by the points alone."""
        offset = self.latent(latents) + self.part

        def decode(local: Tensor) -> Tensor:
            batch, parts, points, _ = local.shape
            tokens = self.point(local) + offset[:, :, None]
            tokens = tokens.transpose(1, 2).reshape(batch * points, parts, -1)
            out: Tensor = self.out(self.blocks(tokens)).view(batch, points, parts)
            return out.transpose(1, 2).to(local.dtype)

        return decode

    def forward(self, latents: Tensor, local: Tensor, poses: PoseTensors | None = None) -> Tensor:
        """Distances (B, P, N) of latents (B, P, Z) at local points (B, P, N, 3)."""
        return self.condition(latents)(local)
