"""`partwright parts match`: parts for a family of shapes that has no labels."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.outputs import add_output

_EPILOG = """\
Writes NAME.ply and NAME.ply.labels.json a shape, and parts.png, shapes in the colours of their parts. Then

  partwright parts family DIR -o MODEL

learns a model of them. Shapes should stand alike. What a fit cuts into many pieces, as the body of a car,
becomes many parts.
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "match",
        help="find the parts that a folder of shapes without labels has in common",
        description="Fits every mesh of a folder, matches the fits' parts across all of them at once, and "
        "labels each shape by the parts that are alike.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("source", metavar="FOLDER", type=Path, help="a folder of meshes")
    add_output(
        command, "DIR", "where to write", reads=_reads, writes=_writes, folder=lambda a: Path(a.output)
    )
    option = command.add_argument
    option(
        "--common",
        metavar="SHARE",
        type=float,
        default=0.3,
        help="share of the shapes that have a part, at least (default: %(default)s)",
    )
    option("--quality", metavar="Q", default="draft", help="of the fits, as for `fit` (default: %(default)s)")
    option("--at-once", metavar="N", type=int, default=0, help="fits (default: one a core)")
    option("--seed", metavar="S", type=int, default=0, help="of the fits (default: %(default)s)")
    command.set_defaults(run="parts_match")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    source = arguments.source
    return sorted(p for p in source.iterdir() if p.is_file()) if source.is_dir() else []


def _writes(arguments: argparse.Namespace) -> list[Path]:
    stems = [path.stem for path in _reads(arguments)]
    names = [f"{stem}.ply{ending}" for stem in stems for ending in ("", ".labels.json")]
    return [arguments.output / name for name in ("parts.png", *dict.fromkeys(names))]
