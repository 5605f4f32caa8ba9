"""`partwright export`: an assembly in another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.export import WRITERS


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "export",
        help="write an assembly in another format",
        description=f"Writes an assembly in the format of FILE's suffix: {', '.join(WRITERS)}.",
    )
    command.add_argument("assembly", metavar="ASSEMBLY", type=Path, help="an assembly file (.json)")
    command.add_argument("-o", "--output", metavar="FILE", type=Path, required=True, help="where to write")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from partwright.assembly import load_assembly
    from partwright.export import export

    export(load_assembly(arguments.assembly), arguments.output)
    return 0
