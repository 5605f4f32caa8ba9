"""`partwright parts reconstruct`: a shape as parts of a trained model."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.outputs import add_output_folder


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "reconstruct",
        help="find the parts of a shape, or in a picture, with a trained model",
        description="Finds latents and poses of a model's parts that make up a plain shape, without labels. "
        "Writes assembly.json, parts.glb, surface.ply, report.json and preview.png. The shape may be turned "
        "about its up axis, and lie on any side if that is unknown. A shape that is none of the model's "
        "family is told so. In a picture the parts are seen by the model's image encoder, as its family "
        "stands, and what was seen is held against the silhouette.",
    )
    # Suppressed: an absent MODEL is not to undo --model.
    command.add_argument(
        "model",
        metavar="MODEL",
        nargs="?",
        default=argparse.SUPPRESS,
        help="a model that ships, or a file (.safetensors); here, or as --model",
    )
    command.add_argument("shape", metavar="SHAPE", type=Path, help="mesh, points, grid, STEP file or picture")
    option = command.add_argument
    option("--model", dest="model", metavar="MODEL", help=argparse.SUPPRESS)
    add_output_folder(command)
    option(
        "--iterations",
        metavar="N",
        type=int,
        default=400,
        help="steps; 0: the start as it is (default: %(default)s)",
    )
    option("--points", metavar="N", type=int, default=2048, help="samples a step (default: %(default)s)")
    option(
        "--start",
        choices=("auto", "encoder", "nearest", "mean"),
        default="auto",
        help="from what the model's encoder sees, from the training shape that fits best, or from the mean "
        "of all; auto: the best of the encoder's, if there is one, and of training shapes' (default: auto)",
    )
    option(
        "--as-it-stands",
        action="store_true",
        help="try no turns: the shape stands as those that the model was trained on",
    )
    option(
        "--resolution",
        metavar="N",
        type=int,
        help="cells along the unit frame, a multiple of 8 (default: 128, up to 256 for thin walls)",
    )
    option("--unit", metavar="U", help="length unit of the shape: um, mm, cm, m, km, in, ft")
    option("--up", metavar="AXIS", help="axis that points up: x, y, z, -x, -y, -z")
    option("--seed", metavar="S", type=int, default=0, help="of the samples (default: %(default)s)")
    command.set_defaults(run="parts_reconstruct")
