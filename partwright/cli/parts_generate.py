"""`partwright parts generate`: new shapes of a model's family."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import shape_text
from partwright.cli.outputs import add_output, given

CHANGE = 0.4  # of `--change`, where it is not given
TRIES = 8  # of `--tries`: with half of the shapes unsound, one of 256 stays so

_EPILOG = """\
SHAPE is an assembly of neural parts (.json), or a folder with one; MODEL:NAME for a shape that the model was
trained on, by name or number: mixers:3; or a mesh, points or a picture, for what is found in it. The same
seed makes the same shapes, and fewer of them the first of more. Ctrl-C keeps the samples that are done.
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "generate",
        help="make new shapes of a learned family",
        description="Makes poses and forms of all parts out of noise. Writes an assembly a sample, a contact "
        "sheet (samples.png) and samples.json, which says how far each is from its nearest training shape, "
        "how often it was made, and what of it is still at fault.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    option = command.add_argument
    option("--model", metavar="MODEL", required=True, help="a model that ships, or a file (.safetensors)")
    add_output(
        command, "DIR", "where to write; MODEL-samples if not given", reads=_reads, writes=_writes,
        folder=_folder, required=False,
    )  # fmt: skip
    option("-n", "--count", metavar="N", type=int, default=8, help="samples (default: %(default)s)")
    option("--seed", metavar="S", type=int, default=0, help="of the noise (default: %(default)s)")
    option(
        "--tries",
        metavar="N",
        type=int,
        default=TRIES,
        help="a shape whose parts come apart or are seen out of place is made anew, up to N tries in all; "
        "1 takes all as they come (default: %(default)s)",
    )
    option("--keep", metavar="PARTS", help="these parts of --of stay: names, separated by commas")
    option("--of", metavar="SHAPE", type=shape_text, help="the shape whose parts are kept")
    option(
        "--poses",
        metavar="SHAPE",
        type=shape_text,
        help="a shape whose parts' poses are kept, but none of their forms",
    )
    option(
        "--like",
        metavar="SHAPE",
        type=shape_text,
        help="samples near a shape",
    )
    option(
        "--change",
        metavar="X",
        type=float,
        help=f"how far from --like: near 0 hardly, at 1 nothing of it is left (default: {CHANGE})",
    )
    command.set_defaults(run="parts_generate")


def _folder(arguments: argparse.Namespace) -> Path:
    return Path(arguments.output or f"{Path(arguments.model).stem}-samples")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return given(arguments.model, arguments.of, arguments.poses, arguments.like)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    names = [sample_name(i, arguments.count) for i in range(max(0, arguments.count))]
    return [arguments.output / name for name in (*names, "samples.png", "samples.json")]


def sample_name(number: int, count: int) -> str:
    """Of a sample's assembly: as many digits as the last one needs, two at least."""
    return f"sample_{number:0{max(2, len(str(count - 1)))}d}.json"
