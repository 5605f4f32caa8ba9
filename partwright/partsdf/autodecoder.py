"""What is trained: the decoder and one latent a part of every shape (section 3.3)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from partwright.errors import SettingError
from partwright.partsdf.config import DecoderSettings
from partwright.partsdf.local import LocalDecoder
from partwright.partsdf.model import Model, make_decoder
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
    def begin_with(self, model: Model, parts: tuple[str, ...], shapes: tuple[str, ...]) -> None:
        """Take over a trained model's decoder, and the latents of shapes that it knows by name.

        Raises:
            SettingError: it has other parts or another decoder, or knows none of the shapes.
        """
        known = {name: number for number, name in enumerate(model.shapes)}
        rows = [number for number, name in enumerate(shapes) if name in known]
        for told, ours, its in (
            ("parts", parts, model.parts),
            ("settings of its decoder", self.decoder.settings, model.config.decoder),
        ):
            if ours != its:
                raise SettingError(f"training.start: {model.name} has other {told} than this training")
        if not rows:
            raise SettingError(f"training.start: {model.name} knows none of the {len(shapes)} shapes")
        state = dict(model.decoder.state_dict())
        if isinstance(self.decoder, LocalDecoder):  # these shapes may reach farther than those did
            state["room"] = torch.maximum(self.decoder.room, state["room"])
        self.decoder.load_state_dict(state)
        self.latents[rows] = model.latents[[known[shapes[number]] for number in rows]]

    @torch.no_grad()
    def limit_latents(self) -> None:
        """Latents keep a norm of at most 1."""
        norm = self.latents.norm(dim=-1, keepdim=True)
        self.latents.div_(norm.clamp(min=1.0))
