"""`partwright export`: an assembly in another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.atomic_io import report_path
from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output
from partwright.export.formats import FORMATS


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "export",
        help="write an assembly in another format",
        description=f"Writes an assembly in the format of FILE's suffix: {', '.join(FORMATS.own)}. "
        "STEP: where OpenCASCADE gets joints of parts wrong they are tried again in other ways, for about a "
        "minute at most; then flat facets stand for them, and FILE.report.json says so.",
    )
    add_assembly(command)
    add_output(command, "FILE", "where to write", reads=lambda a: [a.assembly], writes=_writes)
    option = command.add_argument_group("of some formats").add_argument
    option("--density", metavar="D", type=float, help="in kg/m3 (rigid bodies; default: water)")
    option(
        "--tolerance", metavar="T", type=float, help="what a native solid may be off before a mesh is written"
    )
    option("--free-joint", action="store_true", default=None, help="let the body move")
    option(
        "--physics",
        metavar="NAME",
        help="colliders, too: khr (GLB: rigid bodies), usd (USD), or by names: unreal, godot (GLB, OBJ)",
    )
    option(
        "--links",
        action="store_true",
        default=None,
        help="each child of the root a link (MJCF, URDF, SDFormat)",
    )
    option(
        "--visuals",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="what collides as something else is seen as it is (MJCF, URDF, SDFormat; default: on)",
    )
    option("--by-part", action="store_true", default=None, help="each part by itself (OBJ, PLY, STL, 3MF)")
    option(
        "--joined", action="store_true", default=None, help="the one surface of all parts, blends too (GLB)"
    )
    option("--resolution", metavar="N", type=int, help="cells along the longest side of what is meshed")
    option("--facets", metavar="N", type=int, help="facets of a full circle (OpenSCAD; default: 96)")
    option("--separate", action="store_true", default=None, help="each part a product of its own (STEP)")
    command.set_defaults(run="export")


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, report_path(arguments.output)]
