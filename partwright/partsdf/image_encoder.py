"""A picture to parts: latents, poses and presence of all parts, the silhouette, and where the camera stood.

A small convolutional network looks at the picture (appendix H has a ResNet-18); learned queries, as those of
the encoder of points, hear of what it saw. The paper's tells neither silhouette nor camera.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from partwright.errors import SettingError
from partwright.methods import check_count
from partwright.partsdf.companions import companion_file, load_companion, save_companion, with_weights
from partwright.partsdf.encoder import EncoderSettings, PartQueries, shapes_of
from partwright.partsdf.lighting import MIDDLE, SPREAD
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.views import SIDE

KIND = "image-encoder"
CAMERA = 3  # cosine and sine of the azimuth, elevation
_GROUPS = 8


_QUERIES = EncoderSettings(width=128, heads=4, rounds=1, blocks=2, beside=4)


@dataclass(frozen=True)
class ImageSettings:
    """channels: of the three scales, a quarter, an eighth and a sixteenth of the picture's side; queries."""

    channels: tuple[int, int, int] = (32, 64, 128)
    queries: EncoderSettings = _QUERIES

    def __post_init__(self) -> None:
        for count in self.channels:
            check_count("channels", count, low=1)

    @classmethod
    def of_width(cls, width: int) -> ImageSettings:
        """Tokens of this width, and channels in proportion; raises SettingError."""
        check_count("width", width, low=1)
        if width % (4 * _GROUPS):
            raise SettingError(f"width is {width}; expected a multiple of {4 * _GROUPS}")
        return cls((width // 4, width // 2, width), replace(_QUERIES, width=width))


class _Block(nn.Module):
    """Two convolutions beside a way past them."""

    def __init__(self, before: int, after: int, step: int) -> None:
        super().__init__()
        self.convs = nn.Sequential(
            nn.Conv2d(before, after, 3, step, 1, bias=False), nn.GroupNorm(_GROUPS, after), nn.GELU(),
            nn.Conv2d(after, after, 3, 1, 1, bias=False), nn.GroupNorm(_GROUPS, after),
        )  # fmt: skip
        self.past = nn.Conv2d(before, after, 1, step) if step > 1 else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        return nn.functional.gelu(self.past(x) + self.convs(x))


class ImageNetwork(PartQueries):
    """Pictures (B, 3, SIDE, SIDE) to vectors (B, P, K + 12 + 1), logits of the silhouette (B, SIDE / 2,
    SIDE / 2) and cameras (B, CAMERA)."""

    def __init__(self, parts: int, latent: int, settings: ImageSettings) -> None:
        super().__init__(parts, latent, settings.queries)
        near, middle, far = settings.channels
        width = settings.queries.width
        self.stem = nn.Sequential(
            nn.Conv2d(3, near, 5, 2, 2, bias=False), nn.GroupNorm(_GROUPS, near), nn.GELU()
        )
        self.near = _Block(near, near, 2)
        self.middle = _Block(near, middle, 2)
        self.far = nn.Sequential(_Block(middle, far, 2), _Block(far, far, 1))
        self.up_far, self.up_middle = nn.Conv2d(far, middle, 1), nn.Conv2d(middle, near, 1)
        self.silhouette = nn.Sequential(nn.Conv2d(near, 4, 3, 1, 1), nn.PixelShuffle(2))
        cells = SIDE // 8, SIDE // 16
        self.token_middle, self.token_far = nn.Conv2d(middle, width, 1), nn.Conv2d(far, width, 1)
        self.place = nn.Parameter(0.1 * torch.randn(sum(c * c for c in cells), width))
        self.camera = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, CAMERA))
        self.known = nn.Linear(2 * (middle + far), 1)  # learned at last, by itself (`likeness`)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self.told_of(*self.scales(pictures))

    def scales(self, pictures: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """What convolutions see at a quarter, an eighth and a sixteenth of the pictures' side."""
        near = self.near(self.stem((pictures - MIDDLE) / SPREAD))
        middle = self.middle(near)
        return near, middle, self.far(middle)

    def features(self, middle: Tensor, far: Tensor) -> Tensor:
        """(B, 2 (middle + far)) by which the family's pictures are known, of what is seen at an eighth and a
        sixteenth: how much there is of each thing, and how clear it is where it is clearest."""
        both = [how for seen in (middle, far) for how in (seen.mean(dim=(2, 3)), seen.amax(dim=(2, 3)))]
        return torch.cat(both, dim=1)

    def told_of(self, near: Tensor, middle: Tensor, far: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """As `forward`, of the scales."""
        larger = nn.functional.interpolate
        up = middle + larger(self.up_far(far), scale_factor=2)
        silhouette = self.silhouette(near + larger(self.up_middle(up), scale_factor=2)).squeeze(1)
        tokens = [self.token_middle(up).flatten(2), self.token_far(far).flatten(2)]
        queries = self.asked(torch.cat(tokens, dim=2).transpose(1, 2) + self.place)
        return self.told(queries), silhouette, self.camera(queries[:, self.parts])


@dataclass(frozen=True)
class Sight:
    """What is seen in a picture: the shape in its family's frame, how likely each cell (SIDE / 2, SIDE / 2)
    of the picture is the shape, and where the camera stands, in degrees."""

    shape: NeuralShape
    silhouette: Tensor
    azimuth: float
    elevation: float
    certainty: float
    """About 1 where the network knows from which side it looks, less where several come into question."""
    oddness: float
    """Root mean square of the poses' numbers, off the family's mean and each in its spread there."""
    doubt: float
    """Mean entropy, in bits, of whether each part is there: about 0 where the network is sure, 1 where it
    knows nothing."""
    likeness: float
    """Logit of whether it is a shape of the family at all."""


@dataclass(frozen=True)
class ImageEncoder:
    """A trained network, with the model whose latents and poses it predicts.

    usual: the likeness below which a picture may show no shape of the family (`strangers`).
    """

    model: Model
    settings: ImageSettings
    network: ImageNetwork
    vectors: PartVectors
    usual: float

    def __post_init__(self) -> None:
        if not (isinstance(self.usual, float) and math.isfinite(self.usual)):
            raise SettingError(f"usual is {self.usual}; expected a finite number")

    @torch.no_grad()
    def see(self, pictures: Tensor) -> list[Sight]:
        """What is in pictures (B, 3, SIDE, SIDE), 0 to 1, that a shape nearly fills.

        The form of each part is that of the training shapes' which is most like what is seen. Of forms that
        come into question the network tells the mean, which may be none: an arm in three crumbs.
        """
        near, middle, far = self.network.scales(pictures)
        found, silhouette, camera = self.network.told_of(near, middle, far)
        forms, poses, logits = self.vectors.split(found)
        shapes = shapes_of(self.model, self.vectors.nearest_trained(self.model, forms), poses, logits)
        places = found[..., self.vectors.width : -1]
        numbers = (
            torch.rad2deg(torch.atan2(camera[:, 1], camera[:, 0])),
            torch.rad2deg(camera[:, 2]),
            camera[:, :2].norm(dim=1),  # the mean of unit vectors is shorter, the more they differ
            places.square().mean(dim=(1, 2)).sqrt(),
            torch.distributions.Bernoulli(logits=logits).entropy().mean(dim=1) / math.log(2),
            self.network.known(self.network.features(middle, far))[:, 0],
        )
        rows = zip(shapes, silhouette.sigmoid(), *(n.tolist() for n in numbers), strict=True)
        return [Sight(*row) for row in rows]

    def save(self, path: str | Path) -> None:
        """Write it; raises OutputError."""
        about = {**asdict(self.settings), "usual": self.usual}
        save_companion(path, KIND, self.model, about, self.network.state_dict())


def load_image_encoder(model: Model, path: str | Path | None = None) -> ImageEncoder | None:
    """The image encoder of a file, or of the one beside the model's; None where there is none.

    Raises:
        UnreadableFileError, ModelError, NewerVersionError: as `load_companion`.
    """
    source = companion_file(model, KIND, path)
    if source is None:
        return None

    def made(settings: dict[str, Any], tensors: dict[str, Tensor]) -> ImageEncoder:
        if "usual" not in settings:
            raise ValueError("it does not say what is usual in pictures, as older ones: train it again")
        known = ImageSettings(tuple(settings["channels"]), EncoderSettings(**settings["queries"]))
        vectors = PartVectors.of(model)
        network = with_weights(lambda: ImageNetwork(len(model.parts), vectors.width, known), tensors)
        return ImageEncoder(model, known, network, vectors, settings["usual"])

    return load_companion(source, KIND, model, made)
