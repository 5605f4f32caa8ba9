"""Files that lie beside a model's: networks that were trained for it, and only for it.

MODEL.encoder.safetensors, MODEL.image-encoder.safetensors and MODEL.generator.safetensors are found by the
model's file, and say by its hash which model they are for.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from partwright.atomic_io import write_bytes
from partwright.errors import ModelError, NewerVersionError, SettingError, UnreadableFileError
from partwright.input_files import check_file
from partwright.methods import check_count
from partwright.partsdf.model import SUFFIX, Model, about_file, file_of

# By kind; generators of 2 draw parts before poses, image encoders of 2 know the family by two scales.
VERSIONS = {"encoder": 1, "image-encoder": 2, "generator": 2}
_TRAINED_BY = {
    "encoder": "parts train-encoder",
    "image-encoder": "parts train-encoder --from images",
    "generator": "parts train-generator",
}

T = TypeVar("T")
M = TypeVar("M", bound=nn.Module)


def beside(model: Model, kind: str) -> Path | None:
    """Where the model's companion of a kind lies or would lie; None for a model that came from no file."""
    path = file_of(model)
    return None if path is None else path.with_name(f"{path.stem}.{kind}{SUFFIX}")


def save_companion(
    path: str | Path, kind: str, model: Model, settings: dict[str, Any], tensors: dict[str, Tensor]
) -> None:
    """Write weights in half precision, with the settings that they are read with. Raises OutputError."""
    from safetensors.torch import save

    about = {
        "format": f"partwright-{kind}",
        "version": VERSIONS[kind],
        "model": model.hash,
        "settings": settings,
    }
    half = {k: v.detach().cpu().half().contiguous() for k, v in tensors.items()}
    write_bytes(path, save(half, {"partwright": json.dumps(about)}))


def companion_file(model: Model, kind: str, path: str | Path | None) -> Path | None:
    """The file that is given, or the one beside the model's; None where none is given and none is there."""
    if path is not None:
        return Path(path)
    own = beside(model, kind)
    return own if own is not None and own.exists() else None


def load_companion(
    path: Path, kind: str, model: Model, made: Callable[[dict[str, Any], dict[str, Tensor]], T]
) -> T:
    """What `made` makes of a file's settings and tensors (float32).

    Raises:
        UnreadableFileError: it cannot be read.
        ModelError: it is damaged, of another kind, or for another model.
        NewerVersionError: a newer Partwright wrote it.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load

    check_file(path)
    try:
        data = path.read_bytes()
        tensors, about = load(data), about_file(data)
        if about.get("format") != f"partwright-{kind}":
            raise ModelError(f"{path}: holds no {kind}; expected one that `{_TRAINED_BY[kind]}` wrote")
        if about["version"] > VERSIONS[kind]:
            raise NewerVersionError(f"{path}: version {about['version']}; upgrade Partwright to open it")
        again = f"train it again with `{_TRAINED_BY[kind]}`, or remove it"
        if about["version"] < VERSIONS[kind]:
            raise ModelError(f"{path}: an earlier Partwright trained it, whose {kind} was another; {again}")
        if about["model"] != model.hash:
            raise ModelError(f"{path}: was trained for another model than {model.name}; {again}")
        if not all(value.isfinite().all() for value in tensors.values()):
            raise ValueError("weights are not all finite")
        return made(about["settings"], {name: value.float() for name, value in tensors.items()})
    except OSError as error:
        raise UnreadableFileError(f"cannot read {path}: {error.strerror or error}") from error
    except (
        SafetensorError, KeyError, ValueError, TypeError, RuntimeError, AssertionError, SettingError,
    ) as error:  # fmt: skip
        raise ModelError(f"{path}: damaged, or no {kind} ({error!s:.200})") from error


def with_weights(make: Callable[[], M], tensors: dict[str, Tensor]) -> M:
    """The network that is made, for use, with weights that were read; raises ValueError where they are not
    its own, before it takes any memory."""
    with torch.device("meta"):  # shapes without memory
        check_tensors(make().state_dict(), tensors)
    network = make()
    network.load_state_dict(tensors)
    return network.requires_grad_(False).eval()


def check_tensors(expected: dict[str, Tensor], found: dict[str, Tensor]) -> None:
    """Raise ValueError unless names and shapes are the same; the first may be on the meta device."""
    if expected.keys() != found.keys():
        raise ValueError(f"tensors are missing or too many: {sorted(expected.keys() ^ found.keys())!s:.80}")
    for name, value in expected.items():
        if value.shape != found[name].shape:
            raise ValueError(f"{name} is of shape {tuple(found[name].shape)}, not {tuple(value.shape)}")


def check_tokens(settings: Any) -> None:
    """Raise SettingError unless settings are counts, and the width is shared evenly by the heads."""
    for name, value in asdict(settings).items():
        check_count(name, value, low=0 if name == "beside" else 1)
    if settings.width % settings.heads:
        raise SettingError(f"width is {settings.width}; expected a multiple of the {settings.heads} heads")


def place_for(model: Model, kind: str, wanted: Path | None) -> Path:
    """Where a companion is to be written: as wanted, or beside the model."""
    path = wanted or beside(model, kind)
    if path is None:
        raise SettingError(f"{model.name} came from no file; say where its {kind} is to be written")
    if not path.name.endswith(SUFFIX):
        raise SettingError(f"{path}: expected a name that ends in {SUFFIX}")
    return path
