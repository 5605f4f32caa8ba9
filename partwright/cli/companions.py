"""What commands that train networks beside a model share: `parts train-encoder`, `parts train-generator`."""

from __future__ import annotations

import argparse

from partwright.cli.outputs import add_output, given
from partwright.methods import DEVICES


def add_training(command: argparse.ArgumentParser, kind: str, steps: int, batch: str) -> None:
    """MODEL, --output, --steps, --batch, --device and --seed. batch: what a step learns from."""
    command.add_argument("model", metavar="MODEL", help="a model that ships, or a file (.safetensors)")
    add_output(
        command,
        "FILE",
        f"where to write (default: MODEL.{kind}.safetensors beside the model, where it is looked for)",
        reads=lambda a: given(a.model),
        writes=lambda a: given(a.output),
        required=False,
    )
    option = command.add_argument
    option("--steps", metavar="N", type=int, default=steps, help=f"of {batch} each (default: %(default)s)")
    option("--batch", metavar="N", type=int, help="take so many a step instead")
    option(
        "--device",
        choices=DEVICES,
        default="auto",
        help="where to compute; auto takes an NVIDIA accelerator where there is one (default: %(default)s)",
    )
    option("--seed", metavar="S", type=int, default=0, help="of all that is drawn (default: %(default)s)")
