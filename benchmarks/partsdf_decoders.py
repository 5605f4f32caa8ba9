"""Two decoders trained on the same family for the same processor seconds: the paper's, and the local one."""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from partsdf_scores import command_line, write

from partwright.datasets.prepared import PreparedFamily
from partwright.metrics.iou import occupancy_iou
from partwright.partsdf.config import Config, read_config
from partwright.partsdf.familiarity import familiarity
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct
from partwright.partsdf.targets import Target
from partwright.partsdf.training import train

CONFIGS = Path(__file__).parents[1] / "configs"
ROWS = (
    ("the paper's", "paper", "held"),
    ("the paper's, L_inter over all points", "paper", "all"),
    ("local, L_inter over held points", "first", "held"),
    ("local", "first", "all"),
)
MEANS: dict[str, dict[str, Any]] = {
    "held": {"inter_over": "held", "inter": 1.0},
    "all": {"inter_over": "all", "inter": 5.0},
}
PROBED, KEPT = 6, 5  # epochs of a probe; every fifth sample is measured at, not fitted to
HEAD = [
    "| | steps | s a step | residual % | IoU % | pIoU % | s a reconstruction | s a mesh |",
    "|---|---|---|---|---|---|---|---|",
]


def decoders(arguments: argparse.Namespace) -> None:
    """Each by its own configuration in configs/, of one batch, without validation."""
    family = PreparedFamily(arguments.family)
    lines = [
        f"# PartSDF: two decoders, and two means of L_inter, after {arguments.seconds:.0f} processor seconds "
        f"on {family.name}",
        "",
        "Trained as configs/NAME-paper.toml and configs/NAME-first.toml say, with the same points a step, in "
        "as many epochs as fit; one thread. Held-out shapes are reconstructed with known parts, in "
        f"{arguments.iterations} iterations of {arguments.points:,} points, and scored at the samples near "
        "their surfaces that were not fitted, where a little more or less tells most. The residual is the "
        "mean error of the distance, as a share of the clamp. L_inter is a mean over the points that several "
        "parts hold, with a weight of 1, as in the paper, or over all points, with one of 5. Means over "
        f"{arguments.shapes} shapes; a mesh of the whole has {arguments.resolution} cells along the box.",
        "",
        command_line(),
        "",
        *HEAD,
    ]
    for label, variant, mean in ROWS:
        named = CONFIGS / f"{family.name}-{variant}.toml"  # the one that ships has the family's own name
        config = read_config(named if named.exists() else CONFIGS / f"{family.name}.toml")
        training = replace(
            config.training, validate=0, batch=4, points=512, precision="32-true", warmup=0, threads=1,
            start="",
        )  # fmt: skip
        losses = replace(config.losses, **MEANS[mean])
        config = replace(config, family=arguments.family, losses=losses, training=training)
        lines.append(f"| {label} | {_row(config, family, arguments)} |")
        print(lines[-1], flush=True)
    write(f"decoders-{family.name}", lines)


def _row(config: Config, family: PreparedFamily, arguments: argparse.Namespace) -> str:
    _, first = _trained(config, 1)  # reads the family, too
    _, more = _trained(config, 1 + PROBED)
    epoch = (more - first) / PROBED
    epochs = max(2, round(arguments.seconds / epoch))
    model, spent = _trained(replace(config, training=replace(config.training, warmup=min(150, 15 * epochs))),
                            epochs)  # fmt: skip
    steps = epochs * -(-len(model.shapes) // config.training.batch)
    scores = [_scores(model, family, i, arguments) for i in family.split("test")[: arguments.shapes]]
    residual, iou, parts, seconds, meshed = np.mean(scores, axis=0)
    return (f"{steps:,} | {(spent - first + epoch) / steps:.4f} | {100 * residual:.1f} | {100 * iou:.1f} | "
            f"{100 * parts:.1f} | {seconds:.1f} | {meshed:.1f}")  # fmt: skip


def _trained(config: Config, epochs: int) -> tuple[Model, float]:
    """The model, and processor seconds."""
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        config = replace(config, training=replace(config.training, epochs=epochs))
        return train(config, folder).model, time.process_time() - start


def _scores(
    model: Model, family: PreparedFamily, index: int, arguments: argparse.Namespace
) -> tuple[float, ...]:
    shape = family.load(index)
    held = np.arange(len(shape.sdf)) % KEPT == 0
    fitted, rest = (
        replace(shape, points=shape.points[rows], sdf=shape.sdf[rows], part=shape.part[rows])
        for rows in (~held, held)
    )
    settings = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    start = time.process_time()
    found = reconstruct(model, fitted, settings)
    seconds = time.process_time() - start
    start = time.process_time()
    mesh_shape(found, arguments.resolution, parts=False)
    meshed = time.process_time() - start
    return (
        *_against(found, Target(torch.tensor(rest.points), torch.tensor(rest.sdf)), rest.part),
        seconds,
        meshed,
    )


def _against(found: NeuralShape, target: Target, part: np.ndarray) -> tuple[float, float, float]:
    """Residual, IoU and its mean over parts, at samples."""
    each = found.part_distances(target.points.numpy())
    inside, true = found.whole(each) < 0, target.sdf.numpy() < 0
    numbers = np.flatnonzero(found.present.numpy())
    owner = np.where(inside, numbers[each.argmin(axis=0)], -1)
    label = np.where(true, part, -1)
    parts = [occupancy_iou(owner == p, label == p) for p in numbers]
    return familiarity(found, target).residual, occupancy_iou(inside, true), float(np.mean(parts))
