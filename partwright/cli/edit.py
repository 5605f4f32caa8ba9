"""`partwright edit`: numbers of an assembly set by name."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "edit",
        help="set numbers of an assembly's parts by name",
        description="Sets numbers of parts by name. What stood on a face that moves, or reached out of it, "
        "goes with it, cuts that went through still do, cuts of one face keep their depth, and copies of a "
        "part, or of its group, change with it; each such change is said. `partwright describe` shows names "
        "and numbers, those of a profile in a row: profile.y (0, 8, 20) are profile.y.1 to profile.y.3; of "
        "a pipe's path corner k is path.k.x, path.k.y and path.k.z, with bend.k.",
    )
    option = command.add_argument
    add_assembly(command)
    option(
        "--set",
        metavar="PART.NUMBER=VALUE",
        dest="values",
        action="append",
        required=True,
        help="a number and its new value, say hole.diameter=6mm, base_plate.size.z=12 or 'hole*.x=0'; "
        "lengths without a unit are in the assembly's, angles in degrees; may be given several times; "
        "numbers of a profile are counted before any of them is set",
    )
    option(
        "--alone",
        action="store_true",
        help="only what is named changes, not its like in groups that are copies of one another",
    )
    add_output(command, "FILE", "where to write (.json)", reads=_reads, writes=_writes)
    command.set_defaults(run="edit")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.assembly]


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output]
