"""`partwright parts train-encoder`: a network that sees the parts in points, for a model that is trained."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.outputs import add_output, given


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-encoder",
        help="train a network that sees a model's parts in points",
        description="Learns to tell latents and poses of all parts at once from points of the surface, few "
        "or many, blurred or with a side missing. `parts reconstruct` then begins with what it sees. Ctrl-C "
        "ends with what it has learned.",
    )
    command.add_argument("model", metavar="MODEL", help="a model that ships, or a file (.safetensors)")
    command.add_argument(
        "family", metavar="FAMILY", type=Path, help="the prepared family that it was trained on"
    )
    option = command.add_argument
    add_output(
        command,
        "FILE",
        "where to write (default: MODEL.encoder.safetensors beside the model, where it is looked for)",
        reads=lambda a: given(a.model),
        writes=lambda a: given(a.output),
        required=False,
    )
    option("--steps", metavar="N", type=int, default=5000, help="of 24 clouds each (default: %(default)s)")
    option("--seed", metavar="S", type=int, default=0, help="of all that is drawn (default: %(default)s)")
    command.set_defaults(run="parts_train_encoder")
