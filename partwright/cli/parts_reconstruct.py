"""`partwright parts reconstruct`: a shape as parts of a trained model."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from partwright.cli.outputs import add_output_folder
from partwright.cli.reading import add_reading


class _Name(argparse.Action):
    """The last name is the shape's, and one before it the model's, which --model gives otherwise."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: Any = None
    ) -> None:
        model = namespace.name if option is None else values
        if model is not None:
            if namespace.model is not None:
                parser.error("name the model once: before the shape, or as --model")
            namespace.model = model
        if option is None:
            namespace.name, namespace.shape = values, Path(values)


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "reconstruct",
        help="find the parts of a shape, or in a picture, with a trained model",
        description="Finds latents and poses of a model's parts that make up a plain shape, without labels. "
        "Writes assembly.json, parts.glb, surface.ply, report.json and preview.png. The shape may be turned "
        "about its up axis, and lie on any side if that is unknown. A shape that is none of the model's "
        "family is told so. In a picture the parts are those that the model's image encoder sees, as its "
        "family stands, moved until their outline is the picture's. A picture that looks unlike the family's "
        "is told so: a hint, as some of these are, and some others pass.",
    )
    option = command.add_argument
    option(
        "name",
        metavar="[MODEL] SHAPE",
        action=_Name,
        help="a model that ships, or a file (.safetensors), here or as --model; then a mesh, points, a grid, "
        "a STEP file or a picture",
    )
    # With nargs="?" it would be taken for absent where an option comes between both names.
    option("shape", action=_Name, help=argparse.SUPPRESS).required = False
    option("--model", metavar="MODEL", action=_Name, help="the model, where it is not named before SHAPE")
    add_output_folder(command)
    option(
        "--quality",
        choices=("draft", "normal", "high"),
        help="what iterations, points and starts are, where not given (default: normal)",
    )
    option(
        "--iterations",
        metavar="N",
        type=int,
        help="steps; 0: the start as it is (default: 200)",
    )
    option("--points", metavar="N", type=int, help="samples a step (default: 2048)")
    option(
        "--start",
        choices=("auto", "encoder", "nearest", "mean"),
        help="from what the model's encoder sees, from the training shape that fits best, or from the mean "
        "of all; auto: the best of the encoder's, if there is one, and of training shapes' (default: auto)",
    )
    option(
        "--as-it-stands",
        action="store_true",
        default=None,
        help="try no turns: the shape stands as those that the model was trained on",
    )
    option(
        "--resolution",
        metavar="N",
        type=int,
        help="cells along the unit frame, a multiple of 8 (default: 128, up to 256 for thin walls)",
    )
    add_reading(command)
    option("--seed", metavar="S", type=int, help="of the samples (default: 0)")
    command.set_defaults(run="parts_reconstruct")
