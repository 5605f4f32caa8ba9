"""`partwright clean`: an assembly with plain numbers and exact relations."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.atomic_io import report_path
from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output, given
from partwright.cli.reading import add_thickness


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "clean",
        help="make an assembly's numbers plain and the relations of its parts exact",
        description="Makes what is nearly so exact: parts along the input's axes, coaxial, flush, equal, "
        "mirrored or repeated, named solids, lengths on a grid. Writes the assembly to FILE (.json), and "
        "the relations to FILE.report.json.",
    )
    option = command.add_argument
    add_assembly(command)
    add_output(command, "FILE", "where to write", reads=_reads, writes=_writes)
    option("--shape", metavar="SHAPE", type=Path, help="what it stands for (default: its own surface)")
    add_thickness(command)
    option(
        "--clean-tolerance",
        metavar="X",
        type=float,
        help="how much further from the shape any part may come to lie, on average, in the assembly's units "
        "(default: half a thousandth of the longest side, or the noise of the mesh)",
    )
    command.set_defaults(run="clean")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return given(arguments.assembly, arguments.shape)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, report_path(arguments.output)]
