"""What each piece of PartSDF is worth: Tables 3, 6 (its first row) and 7 on one family, at a small scale; and
what each piece of our own decoder is, trained as a configuration says."""

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
    scale_of,
    trained,
    write,
)

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.config import Config, read_config
from partwright.partsdf.model import Model

# Tables 3 and 7 of the paper, on its own cars; Table 1 for one part. CD x1e4, IoU %, IC, pIoU %.
PUBLISHED = {
    "PartSDF": (1.27, 98.02, 0.931, 94.89),
    "one part": (1.37, 97.41, 0.924, None),
    "without poses": (1.43, 97.81, 0.928, 91.71),
    "without modulation": (1.39, 97.37, 0.923, 92.33),
    "without cross-part layers": (1.27, 98.02, 0.932, 96.37),
    "softmin": (1.31, 97.90, 0.930, 94.78),
    "transformer": (1.25, 98.00, 0.931, 93.44),
}


# At a small scale it is the number of steps that counts, more than the samples of each.
STEPS = {"batch": 1, "points": 256}


def switched(base: Config, name: str, apart: str) -> dict[str, Config]:
    """Every option of both decoders that the paper's tables switch, one at a time, and L_inter, as its Figure
    9. name: of the base; apart: of the parts' hearing nothing of one another."""
    decoder, losses = base.decoder, base.losses
    return {
        name: base,
        "one part": replace(base, one_part=True),
        "without poses": replace(base, poses=False),
        "without modulation": replace(base, decoder=replace(decoder, modulation=False)),
        apart: replace(base, decoder=replace(decoder, cross_part=False)),
        "softmin": replace(base, decoder=replace(decoder, aggregation="softmin")),
        "without L_inter": replace(base, losses=replace(losses, inter=0.0)),
    }


def variants(base: Config) -> dict[str, Config]:
    """Of the paper's decoder; octaves are ours."""
    return {
        **switched(base, "PartSDF", "without cross-part layers"),
        "with 2 octaves (not in the paper)": replace(base, decoder=replace(base.decoder, octaves=2)),
        "transformer": replace(base, decoder=replace(base.decoder, architecture="transformer")),
    }


def variants_of_ours(base: Config) -> dict[str, Config]:
    """Of the local decoder, and of what it has besides."""
    held = replace(base.losses, inter=1.0, inter_over="held")
    return {
        **switched(base, "local", "parts that do not talk"),
        "L_inter over held points, weight 1": replace(base, losses=held),
        "without octaves": replace(base, decoder=replace(base.decoder, octaves=0)),
        "without balance": replace(base, training=replace(base.training, balance=0.0)),
    }


def ablations(arguments: argparse.Namespace) -> None:
    """Each variant trained alike in a folder of its own, where a stopped training goes on, and measured."""
    family = PreparedFamily(arguments.family)
    if arguments.config:
        ours = read_config(arguments.config)
        training = replace(ours.training, epochs=arguments.epochs, threads=arguments.threads, validate=0)
        each = variants_of_ours(replace(ours, family=arguments.family, training=training))
        named = f"ablations-{family.name}-{ours.decoder.architecture}"
    else:
        training = replace(
            TRAINING, epochs=arguments.epochs, threads=arguments.threads, validation=True, **STEPS
        )
        decoder = replace(SMALL, width=arguments.width)
        base = Config(arguments.family, "base", decoder=decoder, losses=LOSSES, training=training)
        each, named = variants(base), f"ablations-{family.name}"
    rows, sizes = [], []
    for number, (label, config) in enumerate(each.items()):
        if arguments.only and label not in arguments.only.split(","):
            continue
        name = f"{named}-{number}"
        model = trained(replace(config, name=name), arguments.work / name)
        scores = measured(named, label, family, model, known, arguments)
        rows.append(line(label, scores, parts=not config.one_part))
        sizes.append(f"{label} {sum(p.numel() for p in model.decoder.parameters()):,}")
        print(rows[-1], flush=True)
        write(named, table(family, model, rows, sizes, arguments))


def table(
    family: PreparedFamily, model: Model, rows: list[str], sizes: list[str], arguments: argparse.Namespace
) -> list[str]:
    """What there is so far, with the paper's rows below."""
    paper = PUBLISHED if family.name == "cars" else {}
    return [
        f"# PartSDF: ablations on {family.name}", "",
        f"Each trained alike: {scale_of(model)}. Known parts. {how_measured(family, arguments)}", "",
        f"Weights of the decoders: {', '.join(sizes)}.", "", command_line(), "", *HEAD, *rows,
        *(published(f"paper, its own cars, {label}", *row) for label, row in paper.items()),
    ]  # fmt: skip
