"""`partwright parts simulate`: drag of many bodies by OpenFOAM, for a network to learn from."""

from __future__ import annotations

import argparse
from pathlib import Path

_EPILOG = """\
AIR is AXIS[,ground][,cells=N][,iterations=N][,speed=V][,seconds=S]: along which axis the air moves, whether
a ground moves with it, cells along the longest side (32), iterations of the solver (200), m/s (30), and
the time limit of one body. Ctrl-C keeps what is done; the same command goes on from there, and what was
simulated in the same air is not simulated again.

  partwright parts simulate cars -o flows --count 60 --air y,ground
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "simulate",
        help="simulate the flow around many shapes (OpenFOAM)",
        description="Runs every shape through OpenFOAM and keeps the pressure on it and its drag, a file "
        "each. Shapes are in their own units, metres where those are unknown.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument(
        "source", metavar="FOLDER_OR_FAMILY", help="a folder of shapes, or mixers, chairs, cars or vehicles"
    )
    command.add_argument("-o", "--output", metavar="FOLDER", type=Path, required=True, help="where to write")
    option = command.add_argument
    option("--air", metavar="AIR", default="x", help="the air around them (default: %(default)s)")
    option(
        "--count", metavar="N", type=int, default=60, help="shapes of a made family (default: %(default)s)"
    )
    option("--seed", metavar="S", type=int, default=0, help="of a made family (default: 0)")
    command.set_defaults(run="parts_simulate")
