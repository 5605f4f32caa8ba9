"""`partwright studio`: an assembly in the browser."""

from __future__ import annotations

import argparse
from pathlib import Path


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "studio",
        help="see, edit and fit an assembly in the browser",
        description="Serves a page that shows and edits an assembly and fits shapes, to this machine alone. "
        "The address it prints holds a secret: whoever has it can use the page. Every edit is kept at once.",
    )
    command.add_argument(
        "file", metavar="FILE", type=Path, nargs="?", help="an assembly (.json), or a shape to fit"
    )
    command.add_argument(
        "--shape",
        metavar="SHAPE",
        type=Path,
        help="the input beside an assembly (default: its source, if it is near)",
    )
    command.add_argument("--port", metavar="N", type=int, help="default: 8765, or another that is free")
    command.add_argument(
        "--host",
        metavar="H",
        default="127.0.0.1",
        help="listen on another address: everyone who reaches it and has the secret can edit and export, "
        "and what is sent is not encrypted",
    )
    command.add_argument("--no-browser", action="store_true", help="only print the address")
    command.set_defaults(run="studio")
