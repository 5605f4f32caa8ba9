"""From a folder of shapes with named parts to a model of them: prepared, looked over, timed, trained."""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from partwright.atomic_io import check_folder
from partwright.datasets.family_check import Finding, check_family, write_check
from partwright.datasets.prepared import PreparedFamily
from partwright.datasets.preparing import PreparationProgress, prepare, reasons_of
from partwright.errors import FamilyError, SettingError
from partwright.partsdf.config import Config, DecoderSettings, LossSettings, TrainingSettings, write_config
from partwright.partsdf.live import LivePicture
from partwright.partsdf.training import EpochReport, Trained, trainer
from partwright.render import Camera

FAMILY, CHECK, CONFIG, PICTURE = "family", "check.md", "training.toml", "live.png"
STEPS = 20_000
_BATCH, _WARM, _TIMED = 4, 3, 8
_LEAST = 3  # shapes: one is kept to test with, and two are the least to learn from


@dataclass(frozen=True)
class Plan:
    """What is about to be done. findings: what is odd about the shapes. steps: that are left
    of `total`; seconds: that they will take, as the first ones on this machine say."""

    family: PreparedFamily
    findings: tuple[Finding, ...]
    config: Config
    steps: int
    total: int
    seconds: float


def learn_family(
    source: str | Path,
    output: str | Path,
    *,
    steps: int = STEPS,
    samples: int = 40_000,
    seed: int = 0,
    threads: int = 0,
    up: str | None = None,
    workers: int | None = None,
    prepared: Callable[[PreparationProgress], None] | None = None,
    planned: Callable[[Plan], None] | None = None,
    progress: Callable[[EpochReport], None] | None = None,
) -> Trained:
    """Prepare the folder `source` into output/family, write output/check.md and output/training.toml, and
    train a model into `output`, with a picture of it as it learns, output/live.png.

    steps: of four shapes each. samples: points a shape. up: the axis that points up; if None, as most of the
    files say (GLB: y), else z. Told: of each shape as it is
    prepared, of the plan before the training begins, and of each epoch. Whatever stops it, the same call goes
    on from there.

    Raises:
        FamilyError: the folder holds no shapes, or too few; names that conflict; or shapes of one part.
        SettingError: fewer steps than one, no such axis, or a name of the folder that no model can have.
        As `prepare` and `train`.
    """
    if steps < 1:
        raise SettingError(f"steps is {steps}; expected 1 or more")
    source, output = Path(source), Path(output)
    if not source.is_dir():
        raise FamilyError(f"{source}: no such folder; give a folder of shapes whose parts are named")
    if output.resolve() == source.resolve():
        raise SettingError(f"{output}: holds the shapes; write the model into another folder")
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", output.absolute().name)
    check_folder(output)
    made = prepare(
        source, output / FAMILY, samples=samples, seed=seed, workers=workers, up=up, progress=prepared
    )
    family = made.family
    if len(family.parts) < 2:
        raise FamilyError(
            f"{source}: every shape is one part, {family.parts[0]!r}; name the nodes of each file after its "
            "parts, or put FILE.labels.json beside it"
        )
    findings = check_family(family, made.refused)
    write_check(output / CHECK, family, findings)
    if len(family) < _LEAST:
        raise FamilyError(
            f"{source}: {len(family)} usable shapes, of which one is kept to test with; learning takes "
            f"{_LEAST} or more, and twenty are a start{reasons_of(made.refused)}"
        )
    config = settings_for(family, name, steps, seed, threads)
    each = seconds_a_step(config)
    # Refuses what was begun with other settings, before these are written.
    learning = trainer(config, output)
    write_config(output / CONFIG, config)
    total, left = learning.total, learning.total - learning.state.step
    if planned is not None:
        planned(Plan(family, tuple(findings), config, left, total, each * left))
    picture = LivePicture(output / PICTURE, family, Camera(up=family.up))

    def told(report: EpochReport) -> None:
        picture.show(report)
        if progress is not None:
            progress(report)

    return learning.run(told)


def settings_for(family: PreparedFamily, name: str, steps: int, seed: int = 0, threads: int = 0) -> Config:
    """A training of our own decoder that suits a laptop, of about as many steps."""
    count = len(family.split("train", "validation"))
    epochs = max(1, round(steps / -(-count // _BATCH)))
    return Config(
        family=str(family.folder),
        name=name,
        decoder=DecoderSettings(architecture="local", latent=64, width=64, layers=5, octaves=5),
        losses=LossSettings(latent=1e-5, inter=5.0, inter_over="all", ramp=20),
        training=TrainingSettings(
            epochs=epochs, batch=_BATCH, points=256, balance=0.25, validation=True, rate=4e-3,
            latent_rate=5e-3, warmup=min(150, 1 + steps // 10), anneal=1.0,
            threads=threads, ease=0.2, validate=epochs, validate_shapes=3, checkpoint=1, seed=seed,
        ),
    )  # fmt: skip


def seconds_a_step(config: Config) -> float:
    """Of the training that the configuration describes, by a few of its steps, which leave nothing behind."""
    with tempfile.TemporaryDirectory() as folder:
        tried = trainer(config, folder)
        for _ in range(_WARM):
            tried.step()
        start = time.monotonic()
        for _ in range(_TIMED):
            tried.step()
        return (time.monotonic() - start) / _TIMED
