"""`partwright describe`: an assembly's tree in words and numbers."""

from __future__ import annotations

import argparse

from partwright.cli.assembly_argument import add_assembly


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "describe",
        help="print an assembly's tree",
        description="Prints the tree of an assembly, a line a part: its kind, its numbers and its place. "
        "What is there several times is said once, with how often, and a last line counts.",
    )
    add_assembly(command)
    command.add_argument("--digits", metavar="N", type=int, default=4, help="of each number (default: 4)")
    command.set_defaults(run="describe")
