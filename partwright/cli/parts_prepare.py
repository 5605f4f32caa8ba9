"""`partwright parts prepare`: shapes made of named parts become what PartSDF trains on."""

from __future__ import annotations

import argparse
from pathlib import Path

_EPILOG = """\
FOLDER holds one shape an entry: a scene whose named nodes are its parts, a folder with a mesh a part (and
perhaps the whole as _whole), or a mesh with FILE.labels.json beside it, as `partwright segment` writes them.
Ctrl-C keeps what is done; the same command goes on from there.
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "prepare",
        help="prepare a family of shapes for training",
        description="Fits a pose to every part and samples signed distance and nearest part around every "
        "shape. Says which shapes it leaves out, and why.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument(
        "source", metavar="FOLDER_OR_FAMILY", help="a folder of shapes, or mixers, chairs, cars or vehicles"
    )
    command.add_argument("-o", "--output", metavar="FOLDER", type=Path, required=True, help="where to write")
    option = command.add_argument
    option("--count", metavar="N", type=int, default=300, help="shapes of a made family (default: 300)")
    option("--samples", metavar="N", type=int, default=100_000, help="points a shape (default: 100000)")
    option(
        "--parts", metavar="A,B", type=_names, default=(), help="the family's parts, in order (default: all)"
    )
    option(
        "--test", metavar="A,B", type=_names, default=(), help="shapes to test on (default: a fifth of them)"
    )
    option(
        "--up",
        metavar="AXIS",
        help="points up in all shapes: x, y, z, -x, -y, -z (default: what most files say, as GLB y; else z)",
    )
    option("--workers", metavar="N", type=int, help="processes (default: one a processor)")
    option("--seed", metavar="S", type=int, default=0, help="of shapes, samples and the split (default: 0)")
    command.set_defaults(run="parts_prepare")


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
