"""`partwright parts train-surrogate`: a network that predicts the drag that was simulated."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.outputs import add_output


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-surrogate",
        help="train a network that predicts drag",
        description="Learns pressure and drag from what `parts simulate` wrote, and says how well it ranks "
        "the bodies that were held out. Use it by `partwright optimise --objective surrogate_drag@FILE`.",
    )
    command.add_argument("flows", metavar="FOLDER", type=Path, help="what `parts simulate` wrote")
    add_output(
        command, "FILE", "the model (.safetensors)", reads=lambda a: [a.flows], writes=lambda a: [a.output]
    )
    option = command.add_argument
    option("--rounds", metavar="N", type=int, default=120, help="over all bodies (default: %(default)s)")
    option(
        "--held-out",
        metavar="N",
        type=int,
        help="bodies that are not learned from but tested on (default: a sixth)",
    )
    option(
        "--mirror",
        metavar="AXIS",
        choices=("x", "y", "z"),
        help="also learn from mirror images across this axis",
    )
    option("--seed", metavar="S", type=int, default=0, help="of the split and the network (default: 0)")
    command.set_defaults(run="parts_train_surrogate")
