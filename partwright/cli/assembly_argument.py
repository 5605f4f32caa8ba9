"""The assembly that a command reads: a file, or the folder that a fit wrote."""

from __future__ import annotations

import argparse
from pathlib import Path

FILE = "assembly.json"


def add_assembly(command: argparse.ArgumentParser) -> None:
    """The positional argument ASSEMBLY, `arguments.assembly`."""
    command.add_argument(
        "assembly",
        metavar="ASSEMBLY",
        type=assembly_file,
        help="an assembly file (.json), or the folder that a fit wrote",
    )


def assembly_file(text: str) -> Path:
    """The file itself, or the assembly of a fit's folder."""
    path = Path(text)
    within = path / FILE
    return within if within.is_file() else path


def shape_text(text: str) -> str:
    """Of a neural shape, which may be no file, as MODEL:NAME: as `assembly_file`, or as it is."""
    path = assembly_file(text)
    return text if path == Path(text) else str(path)
