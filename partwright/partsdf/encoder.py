"""Points to parts at once: latents, poses and presence of all parts of a cloud (section 3.4, appendix B.3).

Learned queries, one a part and some more beside them, hear of the points by cross-attention and of one
another by self-attention, as in 3DShape2VecSet; each part's own says what that part is like. The
paper's has eight layers and no say about which parts there are.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from partwright.errors import EmptyShapeError, ParameterError
from partwright.partsdf.clouds import unit_cloud
from partwright.partsdf.companions import (
    check_tokens,
    companion_file,
    load_companion,
    save_companion,
    with_weights,
)
from partwright.partsdf.decoder import positional_encoding
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors
from partwright.partsdf.poses import PoseTensors

KIND = "encoder"
FEWEST = 32  # points
MOST = 2048  # points that are looked at
_OCTAVES = 6


@dataclass(frozen=True)
class EncoderSettings:
    """width: of tokens; heads; rounds: of cross-attention, each with `blocks` of self-attention; beside:
    queries that are no part's."""

    width: int = 128
    heads: int = 4
    rounds: int = 1
    blocks: int = 3
    beside: int = 12

    def __post_init__(self) -> None:
        check_tokens(self)


class PartQueries(nn.Module):
    """Tokens (B, T, width) of what is seen to vectors (B, P, K + 12 + 1): latents, poses, and the logit of
    presence."""

    def __init__(self, parts: int, latent: int, settings: EncoderSettings) -> None:
        super().__init__()
        self.parts, width = parts, settings.width
        self.query = nn.Parameter(0.1 * torch.randn(parts + settings.beside, width))
        self.heard = nn.LayerNorm(width)
        self.cross = nn.ModuleList(
            nn.MultiheadAttention(width, settings.heads, batch_first=True) for _ in range(settings.rounds)
        )
        self.asking = nn.ModuleList(nn.LayerNorm(width) for _ in range(settings.rounds))
        self.talk = nn.ModuleList(
            nn.TransformerEncoder(
                nn.TransformerEncoderLayer(
                    width, settings.heads, 2 * width, dropout=0.0, batch_first=True, norm_first=True
                ),
                settings.blocks,
                enable_nested_tensor=False,
            )
            for _ in range(settings.rounds)
        )
        self.out = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, latent + POSE + 1))

    def asked(self, tokens: Tensor) -> Tensor:
        """(B, P + beside, width): what all queries have heard of the tokens, and of one another."""
        seen = self.heard(tokens)
        queries = self.query.expand(len(seen), -1, -1)
        for norm, cross, talk in zip(self.asking, self.cross, self.talk, strict=True):
            queries = queries + cross(norm(queries), seen, seen, need_weights=False)[0]
            queries = talk(queries)
        return queries

    def told(self, queries: Tensor) -> Tensor:
        """The vectors (B, P, K + 12 + 1) of what queries have heard."""
        result: Tensor = self.out(queries[:, : self.parts])
        return result


class EncoderNetwork(PartQueries):
    """Clouds (B, N, 3) to vectors (B, P, K + 12 + 1)."""

    def __init__(self, parts: int, latent: int, settings: EncoderSettings) -> None:
        width = settings.width
        point = nn.Sequential(
            nn.Linear(3 + 6 * _OCTAVES, width), nn.GELU(), nn.Linear(width, width), nn.GELU()
        )
        super().__init__(parts, latent, settings)
        self.point = point

    def forward(self, points: Tensor) -> Tensor:
        return self.told(self.asked(self.point(positional_encoding(points, _OCTAVES))))


@dataclass(frozen=True)
class Encoder:
    """A trained network, with the model whose latents and poses it predicts."""

    model: Model
    settings: EncoderSettings
    network: EncoderNetwork
    vectors: PartVectors

    @torch.no_grad()
    def encode(self, points: Tensor) -> list[NeuralShape]:
        """A shape for each of the clouds (B, N, 3), each in its own frame: where the cloud lies.

        At most `MOST` of the points are looked at, spread evenly over their order.

        Raises:
            EmptyShapeError: there are fewer than `FEWEST` points, or they are all at one place.
            ParameterError: a coordinate is not finite.
        """
        if points.shape[1] < FEWEST:
            raise EmptyShapeError(
                f"{points.shape[1]} points are too few to tell parts from; give {FEWEST} or more"
            )
        if not torch.isfinite(points).all():
            raise ParameterError("a point has a NaN or infinite coordinate; all must be finite")
        low, high = points.amin(dim=1), points.amax(dim=1)
        size = (high - low).amax(dim=1)
        if not (size > 0).all():
            raise EmptyShapeError("all points are at one place; give points all over the surface")
        rows = torch.linspace(0, points.shape[1] - 1, min(MOST, points.shape[1])).long()
        framed = unit_cloud(points.float())
        found = self.network(framed[:, rows])
        latents, poses, logits = self.vectors.split(found)
        # Back from the cloud's unit frame to the points'.
        ratio = (size / (framed.amax(dim=1) - framed.amin(dim=1)).amax(dim=1)).float()[:, None, None]
        centre = ((low + high) / 2).float()[:, None]
        poses = PoseTensors(poses.translation * ratio + centre, poses.rotation, poses.scale * ratio)
        return shapes_of(self.model, latents, poses, logits)

    def save(self, path: str | Path) -> None:
        """Write it; raises OutputError."""
        save_companion(path, KIND, self.model, asdict(self.settings), self.network.state_dict())


def shapes_of(model: Model, latents: Tensor, poses: PoseTensors, logits: Tensor) -> list[NeuralShape]:
    """Shapes of latents (B, P, Z), poses (B, P, ...) and logits (B, P) of presence; none is without parts."""
    present = logits > 0
    present[torch.arange(len(present)), logits.argmax(dim=1)] = True
    return [
        NeuralShape.of(model, latents[i], poses.map(lambda t, i=i: t[i]), present[i])
        for i in range(len(latents))
    ]


def load_encoder(model: Model, path: str | Path | None = None) -> Encoder | None:
    """The encoder of a file, or of the one beside the model's; None where there is none.

    Raises:
        UnreadableFileError, ModelError, NewerVersionError: as `load_companion`.
    """
    source = companion_file(model, KIND, path)
    if source is None:
        return None

    def made(settings: dict[str, Any], tensors: dict[str, Tensor]) -> Encoder:
        known = EncoderSettings(**settings)
        vectors = PartVectors.of(model)
        network = with_weights(lambda: EncoderNetwork(len(model.parts), vectors.width, known), tensors)
        return Encoder(model, known, network, vectors)

    return load_companion(source, KIND, model, made)
