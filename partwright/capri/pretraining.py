"""Pre-training on a collection (section 4.1): stage 0 alone, all shapes share T and W.

`python -m partwright.capri FOLDER` makes the collection and trains. Every step depends on the seed and its
own number alone, so a training that is stopped goes on from its checkpoint as if it had not been.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch

from partwright.atomic_io import check_folder, write_bytes
from partwright.capri import stages
from partwright.capri.network import SMALL, CapriNet, NetworkSizes, distances, save_network
from partwright.capri.network_initialisation import initialise_boxes
from partwright.capri.pretraining_dataset import (
    PretrainingDataset,
    load_pretraining_dataset,
    make_pretraining_dataset,
)
from partwright.devices import device_of
from partwright.errors import SettingError, UnreadableFileError

NETWORK, CHECKPOINT, COLLECTION = "network.safetensors", "checkpoint.safetensors", "collection.safetensors"
_MOMENTS = ("exp_avg", "exp_avg_sq")


@dataclass(frozen=True)
class PretrainingSettings:
    """How the network is trained (section 4.1). Defaults are ours, for minutes on a core."""

    parts: int = 256
    """CAD parts that are made and trained on (paper: 5,000)."""
    points: int = 2048
    """Kept of each part (paper: 24,576)."""
    batch: int = 8
    """Parts a step (paper: 24)."""
    draw: int = 512
    """Points of each part a step (paper: all)."""
    steps: int = 1000
    """Of gradient descent (paper: 1,000 epochs)."""
    coarse: float = 0.1
    """Share of the steps that draw no points near the surface, as the authors' program first learns on a
    coarse grid."""
    rate: float = 2e-3
    """Adam's at the start, falling as a half cosine (paper: 1e-4 throughout, with which W needs 10,000 steps
    to reach 1)."""
    seed: int = 0
    """Of parts, weights and batches."""
    every: int = 50
    """Steps between checkpoints."""

    def __post_init__(self) -> None:
        for name in ("parts", "points", "batch", "draw", "steps", "every"):
            if getattr(self, name) < 1:
                raise SettingError(f"{name}: expected 1 or more, got {getattr(self, name)}")
        if self.batch > self.parts:
            raise SettingError(f"batch: {self.batch} is more than the {self.parts} parts; give fewer")
        if not 0 < self.rate < math.inf or not 0 <= self.coarse <= 1 or self.seed < 0:
            raise SettingError("rate: expected more than 0; coarse: 0 to 1; seed: 0 or more")


@dataclass(frozen=True)
class PretrainingReport:
    """A step's loss of reconstruction (eq. 10), mean over the steps since the last report."""

    step: int
    steps: int
    loss: float
    seconds: float


Outcome = Literal["converged", "interrupted"]


def train(
    folder: Path,
    training: PretrainingSettings | None = None,
    sizes: NetworkSizes = SMALL,
    progress: Callable[[PretrainingReport], None] | None = None,
    device: str = "auto",
    workers: int = 1,
) -> Outcome:
    """Trains, or goes on where a training in `folder` was stopped; writes network.safetensors.

    device: "auto", "cpu" or "cuda". workers: processes that make the parts.

    Ctrl-C writes the network as it is, keeps the last checkpoint, and the outcome is "interrupted".

    Raises:
        SettingError: the folder holds a checkpoint of other settings, or there is no such device.
        UnreadableFileError: a file in the folder is damaged.
    """
    training, place = training or PretrainingSettings(), device_of(device)
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / COLLECTION
    if not path.exists():
        made = make_pretraining_dataset(training.parts, training.points, training.seed, workers)
        made.save(path, training.parts, training.seed)
    collection = load_pretraining_dataset(path, training.parts, training.points, training.seed)
    trainer = Trainer(collection, training, sizes, place)
    checkpoint = folder / CHECKPOINT
    if checkpoint.exists():
        trainer.load(checkpoint)
    outcome: Outcome = "converged"
    try:
        trainer.run(checkpoint, progress)
        trainer.save(checkpoint)
    except KeyboardInterrupt:  # perhaps amid a step: the last checkpoint is whole
        outcome = "interrupted"
    save_network(trainer.network, folder / NETWORK)
    return outcome


class Trainer:
    """The network, its optimiser, and the number of steps done."""

    def __init__(
        self,
        collection: PretrainingDataset,
        training: PretrainingSettings,
        sizes: NetworkSizes,
        device: torch.device | None = None,
    ) -> None:
        self.device = device or torch.device("cpu")
        self.collection, self.training = collection.to(self.device), training
        torch.manual_seed(training.seed)
        self.network = CapriNet(sizes)
        initialise_boxes(self.network, training.seed)
        self.network.to(self.device)
        self.optimiser = torch.optim.Adam(self.network.parameters(), training.rate, betas=(0.5, 0.999))
        self.step = 0

    def run(self, checkpoint: Path, progress: Callable[[PretrainingReport], None] | None) -> None:
        started, losses = time.monotonic(), []
        while self.step < self.training.steps:
            losses.append(self.advance())
            if self.step % self.training.every == 0:
                self.save(checkpoint)
                if progress is not None:
                    seconds = time.monotonic() - started
                    progress(
                        PretrainingReport(self.step, self.training.steps, float(np.mean(losses)), seconds)
                    )
                losses = []

    def advance(self) -> float:
        """One step; returns eq. 10."""
        t, net = self.training, self.network
        done = self.step / t.steps
        self.optimiser.param_groups[0]["lr"] = t.rate * (0.05 + 0.95 * math.cos(math.pi / 2 * done) ** 2)
        rng = np.random.default_rng((t.seed, self.step))
        voxels, points, inside = self.collection.draw(t.batch, t.draw, done >= t.coarse, rng)
        distance = distances(net.coefficients(net.encoder(voxels)), points)
        found = stages.sides("weighted_union", distance, net.selection, net.weights)
        loss = stages.loss("weighted_union", found, inside, net.selection, net.weights)
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()
        self.step += 1
        return float(stages.weighted_loss(found, inside).detach())

    def save(self, path: Path) -> None:
        """All that the next step depends on, as safetensors."""
        from safetensors.torch import save

        tensors = {f"network.{name}": value for name, value in self.network.state_dict().items()}
        for name, parameter in self.network.named_parameters():
            state = self.optimiser.state.get(parameter, {})
            tensors |= {f"{moment}.{name}": state[moment] for moment in _MOMENTS if moment in state}
        write_bytes(path, save(tensors, {"about": json.dumps(self._about() | {"step": self.step})}))

    def load(self, path: Path) -> None:
        """Raises SettingError where the checkpoint is of other settings, UnreadableFileError if damaged."""
        from safetensors import SafetensorError, safe_open

        try:
            with safe_open(path, "pt") as file:
                about = json.loads((file.metadata() or {})["about"])
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            step = about.pop("step")
        except (OSError, SafetensorError, KeyError, ValueError) as error:
            raise UnreadableFileError(f"{path}: is no checkpoint ({error}); remove it") from error
        if about != self._about():
            raise SettingError(f"{path}: was trained with other settings; take those, or write elsewhere")
        state = {k.removeprefix("network."): v for k, v in tensors.items() if k.startswith("network.")}
        self.network.load_state_dict(state)
        for name, parameter in self.network.named_parameters():
            if f"exp_avg.{name}" in tensors:
                moments = {moment: tensors[f"{moment}.{name}"].to(self.device) for moment in _MOMENTS}
                self.optimiser.state[parameter] = {"step": torch.tensor(float(step)), **moments}
        self.step = step

    def _about(self) -> dict[str, object]:
        return {"training": asdict(self.training), "sizes": asdict(self.network.sizes)}
