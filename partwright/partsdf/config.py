"""What a training needs to know: checked dataclasses, written as TOML. Defaults are the paper's."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from partwright.errors import SettingError, UnreadableFileError

ARCHITECTURES = ("mlp", "transformer")
AGGREGATIONS = ("min", "softmin")
PRECISIONS = ("32-true", "bf16-mixed", "16-mixed")
ACCELERATORS = ("auto", "cpu", "cuda")

T = TypeVar("T")


@dataclass(frozen=True)
class DecoderSettings:
    """The network (PartSDF, section 3.2 and appendix B.1).

    latent: Z, numbers a part. width: of hidden layers; the paper takes 512, and 256 for chairs. layers: input
    and output counted. modulation: the latent enters every layer, else only the first (Table 3, "latMod").
    cross_part: layers across the parts, eq. 4 (Table 3, "h_cp"). architecture: "mlp", or "transformer" with
    `heads` attention heads over the parts (Table 7). aggregation: "min", or "softmin" over `softness`
    (Table 7; the paper gives no width, ours is a hundredth of the unit length).

    octaves: of sines and cosines of the local point that the first layer of "mlp" also sees, so that fine and
    winding parts are learned in fewer steps; not in the paper, whose decoder has 0.
    """

    latent: int = 256
    width: int = 512
    layers: int = 8
    modulation: bool = True
    cross_part: bool = True
    architecture: str = "mlp"
    heads: int = 4
    aggregation: str = "min"
    softness: float = 0.01
    octaves: int = 0

    def __post_init__(self) -> None:
        _at_least("decoder.latent", self.latent, 1)
        _at_least("decoder.width", self.width, 1)
        _at_least("decoder.layers", self.layers, 2)
        _at_least("decoder.heads", self.heads, 1)
        _at_least("decoder.octaves", self.octaves, 0)
        _positive("decoder.softness", self.softness)
        _one_of("decoder.architecture", self.architecture, ARCHITECTURES)
        _one_of("decoder.aggregation", self.aggregation, AGGREGATIONS)
        if self.architecture == "transformer" and self.octaves:
            raise SettingError(
                f'decoder.octaves is {self.octaves}, but only architecture "mlp" has them; take 0, or "mlp"'
            )
        if self.architecture == "transformer" and self.width % self.heads:
            raise SettingError(
                f"decoder.width is {self.width}, which {self.heads} heads cannot share; take a multiple"
            )


@dataclass(frozen=True)
class LossSettings:
    """Weights of the terms of eq. 6 and their constants (appendix B.2).

    whole, part, inter: weights of eq. 7, 8, 9; `inter = 0` is the ablation of Figure 9. clamp: distances
    beyond it count as it. hard: extra weight of errors towards the wrong side, 0.5 in the authors' program.
    temperature: of eq. 9's softmax. latent: lambda, ramped in over `ramp` epochs.
    """

    whole: float = 0.5
    part: float = 1.0
    inter: float = 1.0
    clamp: float = 0.1
    hard: float = 0.5
    temperature: float = 0.02
    latent: float = 1e-4
    ramp: int = 100

    def __post_init__(self) -> None:
        for name in ("whole", "part", "inter", "latent"):
            _at_least(f"losses.{name}", getattr(self, name), 0.0)
        for name in ("clamp", "temperature"):
            _positive(f"losses.{name}", getattr(self, name))
        _at_least("losses.ramp", self.ramp, 0)
        if not 0 <= self.hard < 1:
            raise SettingError(f"losses.hard is {self.hard}; expected 0 <= hard < 1")


@dataclass(frozen=True)
class TrainingSettings:
    """How long and how fast (appendix B.2).

    epochs; batch: shapes a step, over all devices; at_once: at most so many of them go through the decoder
    together, 0 for all: less memory for the same gradient; points: a shape and step; samples: points of each
    shape that are kept in memory, 0 for all; shapes: at most so many are trained on, 0 for all; validation:
    also train on the validation shapes, as the paper's final models. rate, latent_rate: Adam's, times `decay`
    at 80 % and 90 %. accelerator, devices: as Lightning Fabric has them; precision: "32-true", "bf16-mixed"
    or "16-mixed" (the first and last layer and all losses stay in float32). validate: epochs between
    validations, 0 for none, of `validate_shapes` shapes; checkpoint: minutes between checkpoints.
    """

    epochs: int = 2000
    batch: int = 16
    at_once: int = 0
    points: int = 8192
    samples: int = 0
    shapes: int = 0
    validation: bool = False
    rate: float = 5e-4
    latent_rate: float = 1e-3
    decay: float = 0.35
    accelerator: str = "auto"
    devices: int = 1
    precision: str = "32-true"
    threads: int = 0
    validate: int = 100
    validate_shapes: int = 4
    checkpoint: float = 5.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("epochs", "batch", "points", "devices", "validate_shapes"):
            _at_least(f"training.{name}", getattr(self, name), 1)
        for name in ("at_once", "samples", "shapes", "threads", "validate", "checkpoint", "seed"):
            _at_least(f"training.{name}", getattr(self, name), 0)
        for name in ("rate", "latent_rate", "decay"):
            _positive(f"training.{name}", getattr(self, name))
        _one_of("training.accelerator", self.accelerator, ACCELERATORS)
        _one_of("training.precision", self.precision, PRECISIONS)
        if self.at_once and self.devices > 1:
            raise SettingError(
                "training.at_once is for one device; with several, each has its share of the batch"
            )
        if self.batch % self.devices:
            raise SettingError(
                f"training.batch is {self.batch}, which {self.devices} devices cannot share; take a multiple"
            )


@dataclass(frozen=True)
class Config:
    """A training. family: folder of a prepared family; name: of the model.

    one_part: all parts as one, "Ours-1P" in Table 1. poses: parts have poses, else all points are given in
    the unit frame (Table 3).
    """

    family: str
    name: str
    one_part: bool = False
    poses: bool = True
    decoder: DecoderSettings = field(default_factory=DecoderSettings)
    losses: LossSettings = field(default_factory=LossSettings)
    training: TrainingSettings = field(default_factory=TrainingSettings)

    def __post_init__(self) -> None:
        if not self.name or not all(c.isalnum() or c in "-_." for c in self.name):
            raise SettingError(f"name is {self.name!r}; expected letters, digits, '-', '_' and '.'")


def read_config(path: str | Path) -> Config:
    """The configuration of a TOML file. A relative `family` is taken from the working folder.

    Raises:
        UnreadableFileError: the file is missing or no TOML.
        SettingError: a key is unknown or missing, or a value cannot be used.
    """
    try:
        data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UnreadableFileError(f"cannot read {path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UnreadableFileError(f"{path} is no TOML file: {error}") from error
    try:
        return config_from(data)
    except SettingError as error:
        raise SettingError(f"{path}: {error}") from error


def config_from(data: Mapping[str, Any]) -> Config:
    """The configuration of nested mappings; raises SettingError."""
    return _build(Config, data, "")


def _build(kind: type[T], data: Mapping[str, Any], place: str) -> T:
    hints = get_type_hints(kind)
    unknown = [name for name in data if name not in hints]
    if unknown:
        raise SettingError(f"unknown key {place}{unknown[0]}; expected {', '.join(hints)}")
    values = {name: _value(hints[name], value, place + name) for name, value in data.items()}
    missing = [f.name for f in fields(kind) if _required(f) and f.name not in values]  # type: ignore[arg-type]
    if missing:
        raise SettingError(f"{place}{missing[0]} is missing")
    return kind(**values)


def _required(entry: Any) -> bool:
    from dataclasses import MISSING

    return entry.default is MISSING and entry.default_factory is MISSING


def _value(kind: Any, value: Any, place: str) -> Any:
    if is_dataclass(kind):
        if not isinstance(value, Mapping):
            raise SettingError(f"{place} is {value!r}; expected a table")
        return _build(kind, value, place + ".")  # type: ignore[arg-type]
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not kind or (kind is float and not math.isfinite(value)):
        raise SettingError(f"{place} is {value!r}; expected {kind.__name__}")
    return value


def _at_least(name: str, value: float, least: float) -> None:
    if not value >= least:
        raise SettingError(f"{name} is {value}; expected at least {least}")


def _positive(name: str, value: float) -> None:
    if not value > 0:
        raise SettingError(f"{name} is {value}; expected more than 0")


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise SettingError(f"{name} is {value!r}; expected one of {', '.join(known)}")
