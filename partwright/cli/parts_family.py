"""`partwright parts family`: a folder of shapes with named parts becomes a model of them."""

from __future__ import annotations

import argparse
from pathlib import Path

_EPILOG = """\
FOLDER holds one shape an entry, as for `parts prepare`: a scene whose named nodes are its parts (GLB), a
folder with a mesh a part, or a mesh with FILE.labels.json beside it. DIR gets

  check.md            which shapes will be trouble, and why
  live.png            shapes that are learned from, and what the model makes of them so far
  model.safetensors   the model, for `parts reconstruct DIR/model.safetensors SHAPE` and the others
  training.toml       the settings, for `parts train`
  family/             the shapes as they were learned from

Ctrl-C keeps what has been learned; the same command goes on from there.
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "family",
        help="learn a family of your own from a folder, in one command",
        description="Prepares a folder of shapes with named parts, looks which of them will be trouble, says "
        "how long training will take, and trains a model, with a picture of it as it learns.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("source", metavar="FOLDER", type=Path, help="a folder of shapes")
    command.add_argument("-o", "--output", metavar="DIR", type=Path, required=True, help="where to write")
    option = command.add_argument
    option("--steps", metavar="N", type=int, default=20_000, help="of four shapes each (default: 20000)")
    option("--samples", metavar="N", type=int, default=40_000, help="points a shape (default: 40000)")
    option("--threads", metavar="N", type=int, default=0, help="of the processor (default: one a core)")
    option("--workers", metavar="N", type=int, help="processes that prepare (default: one a processor)")
    option(
        "--up",
        metavar="AXIS",
        help="points up in all shapes: x, y, z, -x, -y, -z (default: what most files say, as GLB y; else z)",
    )
    option("--seed", metavar="S", type=int, default=0, help="of all that is drawn (default: 0)")
    command.set_defaults(run="parts_family")
