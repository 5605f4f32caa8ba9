"""What a training needs to know: checked dataclasses, written as TOML. Defaults are the paper's."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from partwright.atomic_io import write_bytes
from partwright.errors import SettingError, UnreadableFileError
from partwright.input_files import check_file

ARCHITECTURES = ("mlp", "transformer", "local")
AGGREGATIONS = ("min", "softmin")
PRECISIONS = ("32-true", "bf16-mixed", "16-mixed")
MEANS = ("held", "all")
ACCELERATORS = ("auto", "cpu", "cuda")

T = TypeVar("T")


@dataclass(frozen=True)
class DecoderSettings:
    """The network (PartSDF, section 3.2 and appendix B.1)."""

    latent: int = 256
    """Z, numbers a part."""
    width: int = 512
    """Of hidden layers; the paper takes 512, and 256 for chairs."""
    layers: int = 8
    """Input and output counted."""
    modulation: bool = True
    """The latent enters every layer, else only the first (Table 3, "latMod")."""
    cross_part: bool = True
    """Layers across the parts, eq. 4 (Table 3, "h_cp")."""
    architecture: str = "mlp"
    """"mlp", "transformer" (Table 7), or "local", which is ours: parts talk once a shape, and each is then a
    small network near its own cuboid."""
    heads: int = 4
    """Attention heads over the parts; of a transformer, and of local's tokens."""
    token: int = 128
    """Width of the tokens by which the parts of "local" talk."""
    blocks: int = 2
    """Transformer blocks over those tokens."""
    aggregation: str = "min"
    """How parts make up the whole: "min", or "softmin" (Table 7)."""
    softness: float = 0.01
    """Width of the softmin, unit lengths; the paper gives none."""
    octaves: int = 0
    """Of sines and cosines of the local point that the first layer of "mlp" or "local" also sees, so that
    fine and winding parts are learned in fewer steps; the paper's decoder has none."""

    def __post_init__(self) -> None:
        _at_least("decoder.latent", self.latent, 1)
        _at_least("decoder.width", self.width, 1)
        _at_least("decoder.layers", self.layers, 2)
        _at_least("decoder.heads", self.heads, 1)
        _at_least("decoder.octaves", self.octaves, 0)
        _at_least("decoder.token", self.token, 1)
        _at_least("decoder.blocks", self.blocks, 0)
        _positive("decoder.softness", self.softness)
        _one_of("decoder.architecture", self.architecture, ARCHITECTURES)
        _one_of("decoder.aggregation", self.aggregation, AGGREGATIONS)
        if self.architecture == "transformer" and self.octaves:
            raise SettingError(
                f"decoder.octaves is {self.octaves}, but a transformer has none; take 0, or architecture "
                '"mlp" or "local"'
            )
        name = {"transformer": "width", "local": "token"}.get(self.architecture)
        if name and getattr(self, name) % self.heads:
            raise SettingError(
                f"decoder.{name} is {getattr(self, name)}, which {self.heads} heads cannot share; "
                "take a multiple"
            )


@dataclass(frozen=True)
class LossSettings:
    """Weights of the terms of eq. 6 and their constants (appendix B.2)."""

    whole: float = 0.5
    """Weight of eq. 7, the whole shape's distance."""
    part: float = 1.0
    """Weight of eq. 8, the nearest part's distance."""
    inter: float = 1.0
    """Weight of eq. 9, parts that reach into one another; 0 is the ablation of Figure 9."""
    inter_over: str = "held"
    """What eq. 9 is a mean over: "held", the points inside two parts or more, as in the paper; or "all".
    The paper draws 131,072 points a step. Of the few thousand of a small step a handful are held by two
    parts, and would pull as much as all others together."""
    clamp: float = 0.1
    """Unit lengths; distances beyond it count as it."""
    hard: float = 0.5
    """Extra weight of errors towards the wrong side, as in the authors' program."""
    temperature: float = 0.02
    """Of eq. 9's softmax, unit lengths."""
    latent: float = 1e-4
    """lambda, weight of the latents' squared norm."""
    ramp: int = 100
    """Epochs over which lambda is ramped in."""

    def __post_init__(self) -> None:
        for name in ("whole", "part", "inter", "latent"):
            _at_least(f"losses.{name}", getattr(self, name), 0.0)
        for name in ("clamp", "temperature"):
            _positive(f"losses.{name}", getattr(self, name))
        _at_least("losses.ramp", self.ramp, 0)
        _one_of("losses.inter_over", self.inter_over, MEANS)
        if not 0 <= self.hard < 1:
            raise SettingError(f"losses.hard is {self.hard}; expected 0 <= hard < 1")


@dataclass(frozen=True)
class TrainingSettings:
    """How long and how fast (appendix B.2)."""

    epochs: int = 2000
    """Times that each shape is seen."""
    batch: int = 16
    """Shapes a step, over all devices."""
    at_once: int = 0
    """Micro-batch: at most so many shapes go through the decoder together, 0 for all; less memory for the
    same gradient."""
    points: int = 8192
    """Points a shape and step, half of them inside."""
    balance: float = 0.0
    """Share of the points that all parts of a shape share alike, however small they are; the paper's go to
    parts as samples do."""
    samples: int = 0
    """Points of each shape that are kept in memory, 0 for all."""
    shapes: int = 0
    """At most so many shapes are trained on, 0 for all."""
    validation: bool = False
    """Also train on the validation shapes, as the paper's final models."""
    rate: float = 5e-4
    """Adam's learning rate of the decoder."""
    latent_rate: float = 1e-3
    """Adam's learning rate of the latents."""
    decay: float = 0.35
    """Factor on both rates at 80 % and at 90 % of the epochs."""
    latent_spread: float = 1.0
    """Expected norm of the latents that training begins with; the paper's 1. What is left of a random start
    says nothing of the shape, so with less of it new shapes are found and predicted more easily."""
    warmup: int = 0
    """Steps over which both rates rise from nothing; the paper has none."""
    anneal: float = 0.0
    """Share of the epochs, the last ones, over which both rates fall to nothing along a cosine; 0 for the two
    drops of `decay` instead."""
    ease: float = 0.0
    """Share of the epochs, the last ones, in which L_inter has a tenth of its weight: parts that it keeps
    apart to the end are shy of one another, and leave slits between them."""
    accelerator: str = "auto"
    """"auto", "cpu" or "cuda", as Lightning Fabric has them."""
    devices: int = 1
    """GPUs or processes; they share the batch."""
    precision: str = "32-true"
    """"32-true", "bf16-mixed" or "16-mixed"; the first and last layer and all losses stay in float32."""
    threads: int = 0
    """Of the CPU, 0 for one a core."""
    validate: int = 100
    """Epochs between validations, 0 for none."""
    validate_shapes: int = 4
    """Shapes of a validation."""
    checkpoint: float = 5.0
    """Minutes between checkpoints."""
    seed: int = 0
    """Of weights, latents, the order of shapes and the points drawn."""
    start: str = ""
    """A model of the same parts and decoder that training begins with, as `load_model` takes it; latents are
    taken over by the shapes' names. "" for random numbers."""

    def __post_init__(self) -> None:
        for name in ("epochs", "batch", "points", "devices", "validate_shapes"):
            _at_least(f"training.{name}", getattr(self, name), 1)
        for name in ("at_once", "samples", "shapes", "threads", "validate", "checkpoint", "seed", "warmup"):
            _at_least(f"training.{name}", getattr(self, name), 0)
        _positive("training.latent_spread", self.latent_spread)
        for name in ("balance", "anneal", "ease"):
            if not 0 <= getattr(self, name) <= 1:
                raise SettingError(f"training.{name} is {getattr(self, name)}; expected 0 to 1")
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
    """A training: what `parts train` reads from a TOML file."""

    family: str
    """Folder of a prepared family."""
    name: str
    """Of the model: letters, digits, '-', '_' and '.'."""
    one_part: bool = False
    """All parts as one, "Ours-1P" in Table 1."""
    poses: bool = True
    """Parts have poses, else all points are given in the unit frame (Table 3)."""
    decoder: DecoderSettings = field(default_factory=DecoderSettings)
    """The network."""
    losses: LossSettings = field(default_factory=LossSettings)
    """What it minimises."""
    training: TrainingSettings = field(default_factory=TrainingSettings)
    """How long and how fast."""

    def __post_init__(self) -> None:
        if not self.name or not all(c.isalnum() or c in "-_." for c in self.name):
            raise SettingError(f"name is {self.name!r}; expected letters, digits, '-', '_' and '.'")


def read_config(path: str | Path) -> Config:
    """The configuration of a TOML file. A relative `family` is taken from the working folder.

    Raises:
        UnreadableFileError: the file is missing or no TOML.
        SettingError: a key is unknown or missing, or a value cannot be used.
    """
    check_file(Path(path))
    try:
        data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise UnreadableFileError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise UnreadableFileError(f"{path} is no TOML file: {error}") from error
    try:
        return config_from(data)
    except SettingError as error:
        raise SettingError(f"{path}: {error}") from error


def write_config(path: str | Path, config: Config) -> None:
    """Write what `read_config` reads, each value that is not the default's; raises OutputError."""
    lines = [f"{name} = {_toml(getattr(config, name))}" for name in ("family", "name")]
    lines += _changed(config, Config(config.family, config.name))
    for table in ("decoder", "losses", "training"):
        mine = getattr(config, table)
        if changed := _changed(mine, type(mine)()):
            lines += ["", f"[{table}]", *changed]
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def _changed(mine: Any, plain: Any) -> list[str]:
    pairs = {f.name: getattr(mine, f.name) for f in fields(mine) if not is_dataclass(getattr(mine, f.name))}
    return [f"{k} = {_toml(v)}" for k, v in pairs.items() if v != getattr(plain, k)]


def _toml(value: Any) -> str:
    # Of JSON's strings TOML takes all but pairs of surrogates.
    return json.dumps(value, ensure_ascii=False)


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
