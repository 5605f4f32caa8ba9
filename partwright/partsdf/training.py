"""Training: auto-decoding on CPU, one GPU or several (section 3.3, appendix B.2), by Lightning Fabric.

Every step depends on the seed and its own number alone, so a training that is stopped at any point and goes
on from its last checkpoint ends with the same weights, to the bit on the same device and number of threads.
"""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from partwright.atomic_io import check_folder
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import MissingDependencyError, SettingError
from partwright.partsdf.autodecoder import AutoDecoder
from partwright.partsdf.checkpoints import TrainingState, load_checkpoint, save_checkpoint
from partwright.partsdf.config import Config, TrainingSettings
from partwright.partsdf.data import (
    FamilySamples,
    check_training_shapes,
    load_samples,
    needed_room,
    part_names,
)
from partwright.partsdf.gradient_accumulation import backward
from partwright.partsdf.lipschitz import measured_lipschitz
from partwright.partsdf.local import LocalDecoder
from partwright.partsdf.logs import Log
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.poses import PoseTensors, identity
from partwright.partsdf.seeds import mixed
from partwright.partsdf.validation import Validation

MODEL, CHECKPOINT = "model.safetensors", "checkpoint.safetensors"
_RATE_DROPS = (0.8, 0.9)  # shares of the steps
_EASED = 0.1  # of the weight of L_inter, in the last epochs


@dataclass(frozen=True)
class EpochReport:
    """What `progress` is told after each epoch: losses are means over it, unweighted; `model` makes the model
    as it is now."""

    epoch: int
    epochs: int
    whole: float
    part: float
    inter: float
    seconds: float
    model: Callable[[], Model]

    @property
    def seconds_left(self) -> float:
        """As long as the epochs until now make expect."""
        return self.seconds / self.epoch * (self.epochs - self.epoch)


@dataclass(frozen=True)
class Trained:
    """model: as written to `path`. outcome: "converged" where all epochs are done, else "interrupted".
    scores: of the shapes that it is validated on, once all epochs are done, by the log's names."""

    model: Model
    path: Path
    outcome: str
    scores: Mapping[str, float] = field(default_factory=dict)


def train(
    config: Config, folder: str | Path, progress: Callable[[EpochReport], None] | None = None
) -> Trained:
    """Train on a prepared family, or go on where a training in `folder` was stopped.

    Writes model.safetensors, checkpoint.safetensors, log.csv, validation pictures and a TensorBoard log into
    `folder`. Ctrl-C ends after the running step, with a checkpoint and the model as it is.

    Raises:
        FamilyError: fewer than two shapes, or a part that no shape has.
        ModelError, SettingError: `folder` holds a checkpoint of another family, or of other settings.
        MissingDependencyError: Lightning Fabric is not installed.
    """
    return trainer(config, folder).run(progress)


def trainer(config: Config, folder: str | Path) -> Trainer:
    """What `train` runs, before its first step; raises as `train`."""
    check_folder(folder)
    fabric = _fabric(config)
    family = PreparedFamily(config.family)
    splits = ("train", "validation") if config.training.validation else ("train",)
    chosen = family.split(*splits)
    chosen = chosen[: config.training.shapes] if config.training.shapes else chosen
    samples = load_samples(family, chosen, config) if chosen else None
    if samples is None:
        raise SettingError(f"{config.family}: no shape is in the split {' or '.join(splits)}")
    check_training_shapes(family, samples, config)
    Path(folder).mkdir(parents=True, exist_ok=True)
    return Trainer(config, family, samples, Path(folder), fabric)


class Trainer:
    """One training: what `train` runs."""

    def __init__(
        self, config: Config, family: PreparedFamily, samples: FamilySamples, folder: Path, fabric: Any
    ) -> None:
        self.config, self.family, self.folder, self.fabric = config, family, folder, fabric
        self.settings, self.parts = config.training, part_names(family, config)
        torch.manual_seed(self.settings.seed)
        self.plain = AutoDecoder(len(samples), len(self.parts), config.decoder, self.settings.latent_spread)
        if isinstance(self.plain.decoder, LocalDecoder):
            self.plain.decoder.fit_room(needed_room(samples))
        if self.settings.start:
            self.plain.begin_with(load_model(self.settings.start), self.parts, samples.names)
        optimiser = torch.optim.Adam(
            [
                {"params": self.plain.decoder.parameters(), "lr": self.settings.rate},
                {"params": [self.plain.latents], "lr": self.settings.latent_rate},
            ],
            fused=True,
        )
        self.model, self.optimiser = fabric.setup(self.plain, optimiser)
        self.samples = samples.to(fabric.device)
        self.generator = torch.Generator(device=fabric.device)
        self.state = TrainingState(0, torch.zeros(3, device=fabric.device))
        if (folder / CHECKPOINT).exists():
            self.state = load_checkpoint(
                folder / CHECKPOINT, config, samples.names, self.plain, self.optimiser.optimizer
            )
        self.steps = -(-len(samples) // self.settings.batch)  # an epoch
        self._scores: dict[str, float] = {}
        self._reporting = 0.0  # seconds that who is told of an epoch took: no part of the training

    def run(self, report: Callable[[EpochReport], None] | None) -> Trained:
        log = Log(self.folder, self.epoch) if self.fabric.is_global_zero else None
        validation = Validation(self.config, self.family, self.folder) if log else None
        saved, started = time.monotonic(), time.monotonic() - self.state.seconds
        with _stopping() as stop:
            while self.state.step < self.total and not stop():
                self._set_rates()
                self.step()
                self.state.seconds = time.monotonic() - started - self._reporting
                if self.state.step % self.steps == 0:
                    self._end_epoch(log, validation, report)
                if time.monotonic() - saved > 60 * self.settings.checkpoint:
                    self._save()
                    saved = time.monotonic()
            self._save()
        done = self.state.step >= self.total
        path = self.folder / MODEL
        model = self.trained()
        if self.fabric.is_global_zero:
            model = model.save(path)
        self.fabric.barrier()
        return Trained(model, path, "converged" if done else "interrupted", self._scores if done else {})

    @property
    def epoch(self) -> int:
        return self.state.step // self.steps

    @property
    def total(self) -> int:
        """Steps of the whole training."""
        return self.settings.epochs * self.steps

    def step(self) -> None:
        """One step of the optimiser, the one that comes next."""
        batch = self._batch()
        self.generator.manual_seed(mixed(self.settings.seed, self.state.step))
        drawn = self.samples.draw(batch, self.settings.points, self.generator, self.settings.balance)
        # Every process draws for the whole batch, so that their number changes nothing.
        mine = slice(self.fabric.global_rank, None, self.fabric.world_size)
        weight = len(batch[mine]) * self.fabric.world_size / len(batch)
        if not len(batch[mine]):  # a last batch too small for all: this process only keeps the others company
            mine = slice(0, 1)
        shapes, (points, sdf, part) = batch[mine], drawn
        poses = self.samples.poses.map(lambda t: t[shapes])
        self.optimiser.zero_grad()
        own = points[mine], sdf[mine], part[mine]
        found = backward(self.fabric, self.model, shapes, own, poses, self._config_now(), self.epoch, weight)
        self.optimiser.step()
        self.plain.limit_latents()
        self.state.sums += torch.stack(found)
        self.state.step += 1

    def _config_now(self) -> Config:
        """With less of L_inter in the last epochs."""
        losses, settings = self.config.losses, self.settings
        if self.state.step < (1 - settings.ease) * self.total:
            return self.config
        return replace(self.config, losses=replace(losses, inter=_EASED * losses.inter))

    def _batch(self) -> Tensor:
        """The step's shapes (B,), over all processes: an epoch goes through all in an order of its own."""
        order = torch.Generator().manual_seed(mixed(self.settings.seed, self.epoch))
        shuffled = torch.randperm(len(self.samples), generator=order)
        place = self.state.step % self.steps
        return shuffled[place * self.settings.batch :][: self.settings.batch].to(self.fabric.device)

    def _set_rates(self) -> None:
        done = self.state.step / self.total
        if self.settings.anneal:
            late = max(0.0, done - (1 - self.settings.anneal)) / self.settings.anneal
            factor = 0.5 * (1 + math.cos(math.pi * late))
        else:
            factor = self.settings.decay ** sum(done >= drop for drop in _RATE_DROPS)
        if self.state.step < self.settings.warmup:
            factor *= (self.state.step + 1) / self.settings.warmup
        rates = (self.settings.rate, self.settings.latent_rate)
        for group, rate in zip(self.optimiser.param_groups, rates, strict=True):
            group["lr"] = factor * rate

    def _end_epoch(
        self, log: Log | None, validation: Validation | None, report: Callable[[EpochReport], None] | None
    ) -> None:
        whole, part, inter = (self.state.sums / self.steps).tolist()
        self.state.sums.zero_()
        if log is None or validation is None:
            return
        row: dict[str, float] = {"whole": whole, "part": part, "inter": inter}
        row["latent_norm"] = float(self.plain.latents.detach().norm(dim=-1).mean())
        row["rate"], row["seconds"] = self.optimiser.param_groups[0]["lr"], self.state.seconds
        every = self.settings.validate
        if every and (self.epoch % every == 0 or self.epoch == self.settings.epochs):
            self._scores, picture = validation.run(self.trained(), self.epoch)
            row |= self._scores
            log.picture(self.epoch, picture)
        log.row(self.epoch, row)
        if report:
            seconds, epochs, start = self.state.seconds, self.settings.epochs, time.monotonic()
            report(EpochReport(self.epoch, epochs, whole, part, inter, seconds, self.trained))
            self._reporting += time.monotonic() - start

    def _save(self) -> None:
        if self.fabric.is_global_zero:
            path, names = self.folder / CHECKPOINT, self.samples.names
            save_checkpoint(path, self.config, names, self.plain, self.optimiser.optimizer, self.state)

    def trained(self) -> Model:
        """The model as it is now, on the CPU."""
        import copy

        decoder = copy.deepcopy(self.plain.decoder).cpu().requires_grad_(False).eval()
        samples = self.samples.to("cpu")
        average = PoseTensors.of(self.family.average_pose)
        if self.config.one_part or not self.config.poses:
            average = identity(len(self.parts))
        model = Model(
            config=replace(self.config, family=self.family.name),
            parts=self.parts,
            decoder=decoder,
            latents=self.plain.latents.detach().cpu().clone(),
            poses=samples.poses,
            present=samples.present,
            average_pose=average,
            shapes=samples.names,
            lipschitz=1.0,
            up=self.family.up,
        )
        return replace(model, lipschitz=measured_lipschitz(model, samples))


def _fabric(config: Config) -> Any:
    try:
        from lightning_fabric import Fabric
    except ImportError as error:
        raise MissingDependencyError(
            'training needs Lightning Fabric: pip install "partwright[train]"'
        ) from error
    settings = config.training
    if settings.accelerator == "cuda" and not torch.cuda.is_available():
        raise SettingError('training.accelerator is "cuda", but PyTorch finds no CUDA device; take "cpu"')
    if settings.threads:
        torch.set_num_threads(settings.threads)
    strategy = "ddp" if settings.devices > 1 else "auto"
    mixed = settings.precision != "32-true"
    fabric = Fabric(
        accelerator=settings.accelerator,
        devices=settings.devices,
        strategy=strategy,
        plugins=[_mixed(settings)] if mixed else None,
    )
    fabric.launch()
    return fabric


def _mixed(settings: TrainingSettings) -> Any:
    """Mixed precision that leaves points and poses as they are: Fabric's own would round them to half, and
    with them every place by up to 1/500 of the shape."""
    from lightning_fabric.plugins.precision import MixedPrecision

    class KeptInputs(MixedPrecision):
        def convert_input(self, data: Any) -> Any:
            return data

    on_gpu = settings.accelerator == "cuda" or (settings.accelerator == "auto" and torch.cuda.is_available())
    return KeptInputs(settings.precision, "cuda" if on_gpu else "cpu")  # type: ignore[arg-type]


@contextmanager
def _stopping() -> Iterator[Callable[[], bool]]:
    """Ctrl-C is kept until it is asked for; a second one ends at once. Only the main thread hears it."""
    heard = threading.Event()

    def note(number: int, frame: Any) -> None:
        heard.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    if threading.current_thread() is not threading.main_thread():
        yield heard.is_set
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield heard.is_set
    finally:
        signal.signal(signal.SIGINT, before)
