"""`partwright parts train-encoder`: a network that sees parts in points or a picture, for a model."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.companions import add_training


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-encoder",
        help="train a network that sees a model's parts in points, or in a picture",
        description="Learns to tell latents and poses of all parts at once from points of the surface, few "
        "or many, blurred or with a side missing; or from one picture, of renders that are made for it, from "
        "all around, in all colours and lights. `parts reconstruct` then begins with what it sees in points; "
        "what it sees in a picture is the result. Ctrl-C ends with what it has learned.",
    )
    add_training(command, "encoder", 5000, "24 clouds or 32 pictures")
    command.add_argument(
        "--from",
        dest="sees",
        choices=("points", "images"),
        default="points",
        help="what it sees; that of images is written to MODEL.image-encoder.safetensors (default: points)",
    )
    command.add_argument(
        "--width", metavar="N", type=int, default=128, help="of the network's tokens (default: %(default)s)"
    )
    command.add_argument(
        "--views",
        metavar="N",
        type=int,
        default=16_000,
        help="with --from images: views that are ray cast, to be lit anew each step (default: %(default)s)",
    )
    command.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="with --from images: processes that draw the views (default: one a processor)",
    )
    command.add_argument(
        "family", metavar="FAMILY", type=Path, help="the prepared family that it was trained on"
    )
    command.set_defaults(run="parts_train_encoder")
