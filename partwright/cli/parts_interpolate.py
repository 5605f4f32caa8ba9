"""`partwright parts interpolate`: a film from one learned shape to another."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import shape_text
from partwright.cli.outputs import add_output, given


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "interpolate",
        help="draw the way from one learned shape to another",
        description="Draws the shapes between two shapes of one model: a GIF, and a contact sheet beside it "
        "(.png). A and B are assemblies of neural parts (.json), or MODEL:NAME as for `parts edit`.",
    )
    command.add_argument(
        "first", metavar="A", type=shape_text, help="an assembly (.json), a folder with one, or MODEL:NAME"
    )
    command.add_argument("second", metavar="B", type=shape_text, help="another of the same model")
    add_output(command, "FILE", "film (.gif)", reads=_reads, writes=_writes)
    option = command.add_argument
    option("--model", metavar="FILE", help="the model of A and B, if it does not ship")
    option("--steps", metavar="N", type=int, default=24, help="pictures one way (default: %(default)s)")
    option("--size", metavar="N", type=int, default=320, help="pixels a side (default: %(default)s)")
    option(
        "--resolution",
        metavar="N",
        type=int,
        help="cells along the unit frame, a multiple of 8 (default: 64 to 160, by the thinnest wall)",
    )
    command.set_defaults(run="parts_interpolate")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return given(arguments.first, arguments.second, arguments.model)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, arguments.output.with_suffix(".png")]
