"""Held-out shapes reconstructed: PartSDF's Table 1 for one family, and robot arms, six to learn from."""

from __future__ import annotations

import argparse
from dataclasses import replace

from partsdf_scores import (
    HEAD,
    LOSSES,
    SMALL,
    TRAINING,
    command_line,
    how_measured,
    known,
    line,
    measured,
    published,
    remeshed,
    scale_of,
    trained,
    unknown,
    write,
)

from partwright.datasets import prepare
from partwright.datasets.prepared import PreparedFamily
from partwright.metrics.reconstruction import reconstruction_scores
from partwright.partsdf.config import Config, read_config
from partwright.partsdf.model import Model, load_model

# Table 1 of the paper, on its own shapes: Ours, Ours-PC, Ours-1P; CD x1e4, IoU %, IC, pIoU %.
HOW = ("known parts", "from points", "1P")
PUBLISHED = {
    "cars": ((1.27, 98.02, 0.931, 94.89), (1.28, 97.95, 0.930, 94.25), (1.37, 97.41, 0.924, None)),
    "mixers": ((1.60, 94.43, 0.978, 90.42), (1.73, 83.38, 0.966, 78.61), (1.44, 95.16, 0.978, None)),
    "chairs": ((1.30, 97.17, 0.942, 93.67), (1.57, 97.09, 0.942, 88.13), (3.74, 93.78, 0.913, None)),
}


def reconstruction(arguments: argparse.Namespace) -> None:
    """Known parts, part-agnostic, and with a configuration also all parts as one."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    lines = [f"# PartSDF: reconstruction of held-out {family.name}", "",
             f"Trained on {scale_of(model)}. {how_measured(family, arguments)}", "",
             command_line(), "", *HEAD]  # fmt: skip
    name = f"reconstruct-{family.name}"
    for label, how in (("known parts", known), ("part-agnostic", unknown)):
        lines.append(line(label, measured(name, label, family, model, how, arguments)))
    itself = [family.load(i) for i in family.split("test")[: arguments.shapes]]
    best = [reconstruction_scores(remeshed(shape, arguments.resolution), shape) for shape in itself]
    lines.append(line("the shape itself, meshed alike", best))
    if arguments.config:
        scores = measured(name, "one part", family, one_part(arguments), known, arguments)
        lines.append(line("one part (1P)", scores, parts=False))
    for how, row in zip(HOW, PUBLISHED.get(family.name, ()), strict=False):
        lines.append(published(f"paper, its own {family.name}, {how}", *row))
    write(name, lines)


def one_part(arguments: argparse.Namespace) -> Model:
    """The same training with all parts as one; it goes on, or comes back, from the folder of work."""
    config = read_config(arguments.config)
    config = replace(
        config, family=arguments.family, name=f"{config.name}-1p", one_part=True,
        training=replace(config.training, validate=0),
    )  # fmt: skip
    return trained(config, arguments.work / config.name)


def robots(arguments: argparse.Namespace) -> None:
    """Train on 6 of 7 robot arms, whose links are the parts; reconstruct the seventh, each in turn."""
    arguments.shapes = 1
    lines = ["# PartSDF: robot arms", "",
             f"Trained on six arms of seven links, {arguments.epochs} epochs, width {SMALL.width}; the "
             f"seventh reconstructed with known parts and without, in {arguments.iterations} iterations, "
             f"meshed at {arguments.resolution}^3.", "", command_line(), "", *HEAD]  # fmt: skip
    training = replace(TRAINING, epochs=arguments.epochs, threads=arguments.threads)
    for held in arguments.held.split(","):
        folder = arguments.work / f"robots-{held}"
        prepare(arguments.parts, folder / "family", samples=30_000, held_out=(held,), workers=1)
        family = PreparedFamily(folder / "family")
        config = Config(str(family.folder), f"robots-{held}", decoder=SMALL, losses=LOSSES,
                        training=training)  # fmt: skip
        model = trained(config, folder / "model")
        for label, how in (("known parts", known), ("part-agnostic", unknown)):
            scores = measured("robots", f"{held}, {label}", family, model, how, arguments)
            lines.append(line(f"{held}, {label}", scores))
            print(lines[-1], flush=True)
    write("robots", lines)
