"""`partwright parts`: learned families of parts, one file a subcommand."""

from __future__ import annotations

import argparse

from partwright.cli import (
    parts_edit,
    parts_family,
    parts_generate,
    parts_interpolate,
    parts_match,
    parts_prepare,
    parts_reconstruct,
    parts_simulate,
    parts_train,
    parts_train_encoder,
    parts_train_generator,
    parts_train_surrogate,
)

COMMANDS = (
    parts_match,
    parts_prepare,
    parts_train,
    parts_family,
    parts_train_encoder,
    parts_train_generator,
    parts_reconstruct,
    parts_generate,
    parts_edit,
    parts_interpolate,
    parts_simulate,
    parts_train_surrogate,
)


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "parts",
        help="learn a family of shapes made of the same parts",
        description="Shapes of one family, made of the same named parts.",
    )
    subcommands = command.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for subcommand in COMMANDS:
        subcommand.add(subcommands)
