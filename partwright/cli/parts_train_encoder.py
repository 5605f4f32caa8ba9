"""`partwright parts train-encoder`: a network that sees the parts in points, for a model that is trained."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.companions import add_training


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-encoder",
        help="train a network that sees a model's parts in points",
        description="Learns to tell latents and poses of all parts at once from points of the surface, few "
        "or many, blurred or with a side missing. `parts reconstruct` then begins with what it sees. Ctrl-C "
        "ends with what it has learned.",
    )
    add_training(command, "encoder", 5000, "24 clouds")
    command.add_argument(
        "family", metavar="FAMILY", type=Path, help="the prepared family that it was trained on"
    )
    command.set_defaults(run="parts_train_encoder")
