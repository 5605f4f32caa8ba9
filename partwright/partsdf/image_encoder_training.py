"""How an image encoder learns, the decoder frozen: from views of the training shapes, lit anew each time."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d, binary_cross_entropy_with_logits, smooth_l1_loss

from partwright.datasets.prepared import PreparedFamily
from partwright.devices import device_of
from partwright.methods import Cancellation, check_count
from partwright.partsdf.companion_training import check_trainable, descend, follow
from partwright.partsdf.encoder_training import losses
from partwright.partsdf.image_encoder import ImageEncoder, ImageNetwork, ImageSettings
from partwright.partsdf.latent_metric import felt
from partwright.partsdf.lighting import lit
from partwright.partsdf.likeness import learn_likeness
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.strangers import NO_LIMIT, held_out, usual_likeness
from partwright.partsdf.views import PartMeshes, Views, draw_views

VIEWS = 16_000
BATCH = 32
_AVERAGE = 0.995  # what is kept of the averaged weights each step
_STEEPEST = 1.0  # norm of the gradients
_TOLD = 20  # steps


@dataclass(frozen=True)
class ImageStep:
    """latents: share of what they change in distances that is not predicted yet; poses: mean error, in their
    spreads; presence and silhouette: cross-entropies; camera: mean error, radians."""

    number: int
    of: int
    latents: float
    poses: float
    presence: float
    silhouette: float
    camera: float


def train_image_encoder(
    model: Model,
    family: PreparedFamily,
    *,
    steps: int = 5000,
    views: int = VIEWS,
    batch: int = BATCH,
    rate: float = 1e-3,
    seed: int = 0,
    device: str = "auto",
    settings: ImageSettings | None = None,
    workers: int = 1,
    drawn: Callable[[int, int], None] | None = None,
    told: Callable[[ImageStep], None] | None = None,
    cancel: Cancellation | None = None,
) -> ImageEncoder:
    """An image encoder for a model, from the prepared family that it was trained on; after a cancellation, as
    far as it has come.

    workers: processes that draw the views, which are the same by however many; a script with more than one
    needs `if __name__ == "__main__":`. drawn: told how many of the `views` there are, of which steps then
    take `batch` each. device: "auto", "cpu" or "cuda".

    Raises:
        FamilyError: it is another family, or was prepared without surfaces.
        SettingError: fewer than one step, view, picture or worker, a model of one part, which has no poses,
            or no such device, or a process that draws was ended.
    """
    check_trainable(model, steps, batch, "an encoder predicts")
    check_count("views", views, low=1)
    check_count("workers", workers, low=1)
    place, settings = device_of(device), settings or ImageSettings()
    vectors = PartVectors.of(model)
    views = min(views, steps * batch)  # no more than are looked at
    count = (lambda done: drawn(done, views)) if drawn else None
    meshes = PartMeshes.of(family, model)
    random = torch.Generator().manual_seed(seed)
    seen = draw_views(meshes, model, views, random, count, cancel, workers).to(place)
    metric, known, own = felt(model, vectors).to(place), vectors.to(place), model.to(place)
    torch.manual_seed(seed)
    with place:
        network = ImageNetwork(len(model.parts), vectors.width, settings)
    kept = copy.deepcopy(network).requires_grad_(False)
    generator = torch.Generator(place).manual_seed(seed)

    def terms() -> Tensor:
        with place:  # all that is drawn
            rows = torch.randint(len(seen.label), (batch,), generator=generator)
            return picture_losses(network, known, metric, own, seen, rows, generator)

    def heard(number: int, means: list[float]) -> None:
        if told is not None:
            told(ImageStep(number, steps, *means))

    descend(
        network.parameters(), terms, steps=steps, rate=rate, told=heard, every=_TOLD, cancel=cancel,
        steepest=_STEEPEST, after=lambda step: follow(kept, network, step, _AVERAGE),
    )  # fmt: skip
    encoder = ImageEncoder(model, settings, kept.cpu().eval(), vectors, NO_LIMIT)
    learn_likeness(encoder.network, seen.to(torch.device("cpu")), model.up, random, workers)
    return replace(encoder, usual=usual_likeness(encoder, held_out(family)))


def picture_losses(
    network: ImageNetwork,
    vectors: PartVectors,
    metric: Tensor,
    model: Model,
    views: Views,
    rows: Tensor,
    generator: torch.Generator,
) -> Tensor:
    """(5,) of latents, poses, presence, silhouette and camera, of pictures made of the views `rows` (B,).

    metric: of `felt`.
    """
    pictures, silhouette = lit(views, rows, generator)
    # Half precision is emulated by most processors, at several times the seconds of single precision.
    with torch.autocast("cuda", torch.bfloat16, enabled=pictures.device.type == "cuda"):
        found, logits, camera = network(pictures.contiguous(memory_format=torch.channels_last))
    donors = views.donors[rows]
    latents = model.latents[donors, torch.arange(len(model.parts))]
    poses, present = views.poses.map(lambda t: t[rows]), views.present[rows]
    about_parts = losses(found.float(), vectors, latents, poses, present, metric)
    covered = binary_cross_entropy_with_logits(logits.float(), avg_pool2d(silhouette, 2))
    stood = smooth_l1_loss(camera.float(), views.camera[rows], beta=0.1)
    return torch.cat([about_parts, covered[None], stood[None]])
