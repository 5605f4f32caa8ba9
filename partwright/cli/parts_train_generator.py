"""`partwright parts train-generator`: networks that make new shapes of a model's family."""

from __future__ import annotations

import argparse

from partwright.cli.companions import add_training


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train-generator",
        help="train networks that make new shapes of a model's family",
        description="Learns, from the latents and poses of the model's own training shapes, to make poses of "
        "noise, and latents that suit them (two diffusions). `parts generate` uses it. Ctrl-C ends with what "
        "it has learned.",
    )
    add_training(command, "generator", 3200, "64 shapes")
    command.set_defaults(run="parts_train_generator")
