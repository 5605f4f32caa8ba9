"""`partwright parts train-generator`: networks that make new shapes of a model's family."""

from __future__ import annotations

import argparse

from partwright.cli.outputs import add_output, given


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-generator",
        help="train networks that make new shapes of a model's family",
        description="Learns, from the latents and poses of the model's own training shapes, to make poses of "
        "noise, and latents that suit them (two diffusions). `parts generate` uses it. Ctrl-C ends with what "
        "it has learned.",
    )
    command.add_argument("model", metavar="MODEL", help="a model that ships, or a file (.safetensors)")
    option = command.add_argument
    add_output(
        command,
        "FILE",
        "where to write (default: MODEL.generator.safetensors beside the model, where it is looked for)",
        reads=lambda a: given(a.model),
        writes=lambda a: given(a.output),
        required=False,
    )
    option("--steps", metavar="N", type=int, default=3000, help="of 64 shapes each (default: %(default)s)")
    option("--seed", metavar="S", type=int, default=0, help="of all that is drawn (default: %(default)s)")
    command.set_defaults(run="parts_train_generator")
