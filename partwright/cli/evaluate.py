"""`partwright evaluate`: how well an assembly stands for a shape."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import add_assembly
from partwright.cli.reading import add_thickness


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "evaluate",
        help="score an assembly against a shape",
        description="Scores an assembly against the shape it stands for.",
    )
    add_assembly(command)
    command.add_argument("shape", metavar="SHAPE", type=Path, help="the mesh or scene it was made from")
    add_thickness(command)
    command.add_argument("--json", action="store_true", help="print the scores as JSON")
    command.add_argument(
        "--cad",
        metavar="POINTS",
        nargs="?",
        type=int,
        const=30_000,
        help="also normal consistency, edge Chamfer, light field distance, primitives and convexes, "
        "from this many points (default: 30000; CAPRI-Net's tables have 8000)",
    )
    command.set_defaults(run="evaluate")
