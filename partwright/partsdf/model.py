"""A trained model: the decoder, the shapes it was trained on as latents and poses, and its file."""

from __future__ import annotations

import copy
import glob
import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from partwright.atomic_io import write_bytes
from partwright.datasets.prepared import UP
from partwright.errors import ModelError, NewerVersionError, SettingError, UnreadableFileError
from partwright.input_files import check_file
from partwright.partsdf.config import Config, DecoderSettings, config_from
from partwright.partsdf.decoded import Decoded
from partwright.partsdf.decoder import Conditioned, Decoder
from partwright.partsdf.local import LocalDecoder
from partwright.partsdf.losses import aggregate
from partwright.partsdf.offsets import OffsetRange
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.transformer import TransformerDecoder
from partwright.shapes.units import canonical_up

FORMAT, VERSION = "partwright-partsdf", 1
SUFFIX = ".safetensors"
SHIPPED = Path(__file__).parent / "models"
FOLDERS = "PARTWRIGHT_MODELS"  # environment variable: folders, separated as PATH is
_BOX, _ROOM = 1.5, 1.25  # of decoders that hold nothing to its cuboid
_DECODERS: dict[str, type[nn.Module]] = {
    "mlp": Decoder,
    "transformer": TransformerDecoder,
    "local": LocalDecoder,
}


@dataclass(frozen=True)
class Model:
    """A decoder with the shapes that it was trained on.

    parts: names of the P parts. latents (S, P, Z), poses (S, P, ...), present (S, P) bool of the S training
    shapes, named `shapes`; average_pose: P rows, of parts that are missing. lipschitz: the steepest change
    of a part's distance per length that was measured near the training shapes, with a margin. up: the axis
    that points up in the family. hash: of the file.
    """

    config: Config
    parts: tuple[str, ...]
    decoder: nn.Module
    latents: Tensor
    poses: PoseTensors
    present: Tensor
    average_pose: PoseTensors
    shapes: tuple[str, ...]
    lipschitz: float
    up: str = UP
    hash: str = ""

    @property
    def name(self) -> str:
        return self.config.name

    @cached_property
    def room(self) -> Tensor:
        """(P, 3) how far the surface of each part may lie along its axes, in half-lengths of its cuboid."""
        room = getattr(self.decoder, "room", None)
        return torch.full((len(self.parts), 3), _ROOM) if room is None else room

    def box(self, part: str) -> np.ndarray:
        """(3,) half-lengths, in those of its cuboid, of a box that holds a part's surface."""
        held = isinstance(self.decoder, LocalDecoder)
        return np.asarray(self.room[self.index(part)]) if held else np.full(3, _BOX)

    @property
    def asked(self) -> int:
        """About how many parts are decoded at a point."""
        return 1 if self.config.decoder.architecture == "local" else len(self.parts)

    @cached_property
    def offset_range(self) -> OffsetRange:
        """How the boxes of two parts lie to each other in the training shapes."""
        return OffsetRange.of(self.poses, self.present)

    @cached_property
    def mean_latent(self) -> Tensor:
        """(P, Z) over the training shapes that have the part."""
        weight = self.present.float()[..., None]
        return (weight * self.latents).sum(0) / weight.sum(0).clamp(min=1)

    @cached_property
    def absent_latent(self) -> Tensor:
        """(P, Z) over the training shapes that miss the part; where all have it, the mean latent."""
        weight = (~self.present).float()[..., None]
        mean = (weight * self.latents).sum(0) / weight.sum(0).clamp(min=1)
        return torch.where(weight.sum(0) > 0, mean, self.mean_latent)

    def to(self, device: torch.device) -> Model:
        """The same on another device."""
        poses, average = (p.map(lambda t: t.to(device)) for p in (self.poses, self.average_pose))
        decoder = copy.deepcopy(self.decoder).to(device)
        return replace(
            self, decoder=decoder, latents=self.latents.to(device), present=self.present.to(device),
            poses=poses, average_pose=average,
        )  # fmt: skip

    def index(self, part: str) -> int:
        """The number of a part; raises SettingError for another name."""
        if part not in self.parts:
            raise SettingError(f"{self.name} has no part {part!r}; its parts are {', '.join(self.parts)}")
        return self.parts.index(part)

    def condition(self, latents: Tensor, poses: PoseTensors) -> Conditioned:
        """The decoder with latents (B, P, Z) and poses (B, P, ...) taken in."""
        return self.decoder.condition(latents, poses)  # type: ignore[operator]

    def decoded(self, latents: Tensor, poses: PoseTensors) -> Decoded:
        """One shape with latents (P, Z) and poses (P, ...), taken in once for any number of points."""
        return Decoded(self.condition(latents[None], poses.map(lambda t: t[None])), poses)

    def part_distances(self, latents: Tensor, poses: PoseTensors, points: Tensor) -> Tensor:
        """(P, N) at points (N, 3) of one shape with latents (P, Z) and poses (P, ...), unit frame."""
        return self.decoded(latents, poses).parts(points)

    def distances(self, latents: Tensor, poses: PoseTensors, points: Tensor) -> Tensor:
        """(N,) of the whole shape; arguments as in `part_distances`."""
        return aggregate(self.part_distances(latents, poses, points)[None], self.config.decoder)[0]

    def to_bytes(self, half: bool = False) -> bytes:
        """The model's file; with `half`, weights and latents are rounded to float16."""
        from safetensors.torch import save

        kind = torch.float16 if half else torch.float32
        tensors = {f"decoder.{k}": v.to(kind) for k, v in self.decoder.state_dict().items()}
        tensors |= {"latents": self.latents.to(kind), "present": self.present.to(torch.uint8)}
        for prefix, poses in (("poses", self.poses), ("average_pose", self.average_pose)):
            tensors |= {f"{prefix}.{k}": v for k, v in poses._asdict().items()}
        about = {
            "format": FORMAT,
            "version": VERSION,
            "config": asdict(self.config),
            "parts": self.parts,
            "shapes": self.shapes,
            "slope": self.lipschitz,
            "up": self.up,
        }
        tensors = {k: v.detach().cpu().contiguous() for k, v in tensors.items()}
        return save(tensors, {"partwright": json.dumps(about)})

    def save(self, path: str | Path, half: bool = False) -> Model:
        """Write the model's file, and return the model as it was written, with its hash.

        Raises:
            OutputError: it cannot be written.
        """
        data = self.to_bytes(half)
        write_bytes(path, data)
        made = model_from_bytes(data, str(path))
        return _remembered(made, _files.get(made.hash, Path(path)))


def load_model(source: str | Path) -> Model:
    """A model by its file, the folder that it was trained into, or the name of one that ships or lies in a
    folder of $PARTWRIGHT_MODELS.

    Raises:
        ModelError: no such model, or a file of another form.
        UnreadableFileError: the file cannot be read.
        NewerVersionError: a newer Partwright wrote it.
    """
    path = Path(source)
    if path.suffix != SUFFIX:
        trained = path / f"model{SUFFIX}"
        path = trained if trained.is_file() else _named(str(source))
    check_file(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UnreadableFileError(f"cannot read the model {path}: {error.strerror or error}") from error
    return _remembered(model_from_bytes(data, str(path)), path)


def file_of(model: Model) -> Path | None:
    """The file that a model was last read from or written to; None if there was none."""
    return _files.get(model.hash)


def find_model(name: str, hash: str) -> Model:
    """The model of this name and hash: one that was loaded before, ships, lies in a models' folder, or in the
    working folder or one of its folders, as a file or folder of its name.

    Raises:
        ModelError: there is none; the message says where one would be looked for.
    """
    if hash in _loaded:
        return _loaded[hash]
    for path in (*_candidates(), *_here(name)):
        if path.stem == name or path.parent.name == name:
            model = load_model(path)
            if model.hash == hash:
                return model
    raise ModelError(
        f"the parts need the model {name!r} with hash {hash[:12]}, which is not here; run this where its "
        f"folder lies, name that in ${FOLDERS}, or load the model first (partwright.partsdf.load_model)"
    )


def model_from_bytes(data: bytes, where: str) -> Model:
    """The model of a file's bytes; raises as `load_model`."""
    from safetensors import SafetensorError
    from safetensors.torch import load

    try:
        tensors = load(data)
        about = about_file(data)
        if about.get("format") != FORMAT:
            raise ModelError(f"{where}: holds no PartSDF model; expected one that `parts train` wrote")
        if about["version"] > VERSION:
            raise NewerVersionError(f"{where}: version {about['version']}; upgrade Partwright to open it")
        return replace(_model(about, tensors), hash=hashlib.sha256(data).hexdigest())
    except (SafetensorError, KeyError, ValueError, TypeError, RuntimeError, SettingError) as error:
        raise ModelError(f"{where}: damaged, or no PartSDF model ({error!s:.200})") from error


def make_decoder(parts: int, settings: DecoderSettings) -> nn.Module:
    return _DECODERS[settings.architecture](parts, settings)


_loaded: dict[str, Model] = {}
_files: dict[str, Path] = {}


def _remembered(model: Model, path: Path) -> Model:
    _files[model.hash] = path
    return _loaded.setdefault(model.hash, model)


def _model(about: dict[str, Any], tensors: dict[str, Tensor]) -> Model:
    config = config_from(about["config"])
    parts, shapes = tuple(about["parts"]), tuple(about["shapes"])
    latents, present = tensors["latents"].float(), tensors["present"].bool()
    poses, average = (
        PoseTensors(*(tensors[f"{key}.{k}"] for k in PoseTensors._fields))
        for key in ("poses", "average_pose")
    )
    decoded = (len(shapes), len(parts))
    _check_shape("latents", latents, (*decoded, config.decoder.latent))
    _check_shape("present", present, decoded)
    for name, width in zip(PoseTensors._fields, (3, 4, 3), strict=True):
        _check_shape(f"poses.{name}", getattr(poses, name), (*decoded, width))
        _check_shape(f"average_pose.{name}", getattr(average, name), (len(parts), width))
    prefix = "decoder."
    weights = {k[len(prefix) :]: v for k, v in tensors.items() if k.startswith(prefix)}
    decoder = _decoder_of(len(parts), config.decoder, weights)
    slope, up = float(about["slope"]), canonical_up(str(about.get("up", UP)))
    return Model(config, parts, decoder, latents, poses, present, average, shapes, slope, up)


def _decoder_of(parts: int, settings: DecoderSettings, weights: dict[str, Tensor]) -> nn.Module:
    """The decoder with these weights. What its settings claim is compared with them before it is made."""
    if settings.layers > len(weights):
        raise ValueError(f"{settings.layers} layers are said, and {len(weights)} tensors are there")
    with torch.device("meta"):  # shapes without memory
        claimed = make_decoder(parts, settings).state_dict()
    for name in claimed.keys() & weights.keys():
        _check_shape(name, weights[name], tuple(claimed[name].shape))
    if claimed.keys() != weights.keys():
        raise ValueError(f"tensors are missing or too many: {sorted(claimed.keys() ^ weights.keys())!s:.80}")
    decoder = make_decoder(parts, settings)
    decoder.load_state_dict(weights)
    return decoder.requires_grad_(False).eval()


def _check_shape(name: str, tensor: Tensor, shape: tuple[int, ...]) -> None:
    if tuple(tensor.shape) != shape:
        raise ValueError(f"{name} is of shape {tuple(tensor.shape)}; the model's settings say {shape}")


def about_file(data: bytes) -> dict[str, Any]:
    """The line that a safetensors file carries: its header is JSON behind eight bytes of length."""
    size = int.from_bytes(data[:8], "little")
    return dict(json.loads(json.loads(data[8 : 8 + size])["__metadata__"]["partwright"]))


def _named(name: str) -> Path:
    paths = [p for p in _candidates() if p.stem == name or (p.stem == "model" and p.parent.name == name)]
    if not paths:
        known = ", ".join(sorted({p.stem for p in _candidates() if p.stem != "model"})) or "none"
        path = Path(name)
        if path.is_dir():
            why = f"{name}: a folder without model{SUFFIX}"
        else:
            why = f"{name}: no model's file" if path.exists() else f"no model is named {name!r}"
        raise ModelError(
            f"{why}; here are: {known}. Give a model's file ({SUFFIX}), or name its folder in ${FOLDERS}"
        )
    return paths[0]


def _here(name: str) -> list[Path]:
    """Files that may be a model of this name, in the working folder and those in it."""
    if not name or name in (".", "..") or set(name) & set("/\\"):
        return []
    known = glob.escape(name)
    patterns = (f"{known}{SUFFIX}", f"{known}/model{SUFFIX}")
    return [path for p in patterns for path in (*Path().glob(p), *sorted(Path().glob(f"*/{p}")))]


def _candidates() -> Sequence[Path]:
    """Files that may be models: those that ship, and those in the user's folders or one below."""
    folders = [Path(f) for f in os.environ.get(FOLDERS, "").split(os.pathsep) if f]
    patterns = (f"*{SUFFIX}", f"*/model{SUFFIX}")
    own = [path for folder in folders for pattern in patterns for path in sorted(folder.glob(pattern))]
    # MODEL.encoder.safetensors and the like belong to a model, and are none.
    return [path for path in (*sorted(SHIPPED.glob(f"*{SUFFIX}")), *own) if "." not in path.stem]
