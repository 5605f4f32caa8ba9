"""`partwright parts edit`: single parts swapped, moved, turned, scaled or dropped; the others adapt."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from partwright.cli.assembly_argument import shape_text
from partwright.cli.outputs import add_output, given

_EPILOG = """\
SHAPE is an assembly of neural parts (.json), the folder that `parts reconstruct` wrote, or MODEL:NAME for a
shape that a model was trained on, by name or number: mixers:3. Lengths are those of the unit frame, whose
longest side is 1.8. Edits are done in the order in which they are given.
"""


class _Edit(argparse.Action):
    """Collects edits of all kinds in one list, in their order."""

    def __call__(
        self, parser: Any, namespace: argparse.Namespace, values: Any, option_string: str | None = None
    ) -> None:
        edits = list(namespace.edits or [])
        namespace.edits = [*edits, (str(option_string).lstrip("-"), values)]


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "edit",
        help="change single parts of a learned shape",
        description="Changes single parts; the others adapt to them. Writes an assembly, and a picture of it "
        "beside it (.png).",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument(
        "shape",
        metavar="SHAPE",
        type=shape_text,
        help="an assembly (.json), a folder with one, or MODEL:NAME",
    )
    add_output(command, "FILE", "assembly (.json)", reads=_reads, writes=_writes)
    command.add_argument("--model", metavar="FILE", help="the model of SHAPE, if it does not ship")

    edits = command.add_argument_group("edits")

    def option(name: str, metavar: str, text: str) -> None:
        edits.add_argument(name, metavar=metavar, action=_Edit, dest="edits", default=[], help=text)

    option(
        "--swap", "PART=SHAPE", "take the part's form from MODEL:SHAPE, or a file or folder of the same model"
    )
    option("--resample", "PART=SEED", "give the part a random form")
    option("--move", "PART=X,Y,Z", "move the part")
    option("--turn", "PART=X,Y,Z,DEGREES", "turn the part about its centre, around an axis")
    option("--scale", "PART=X,Y,Z", "stretch the part along its own axes")
    option("--drop", "PART", "leave the part out, as if the shape had never had it")
    command.set_defaults(run="parts_edit")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    named = [text.partition("=")[2] for name, text in arguments.edits if name == "swap"]
    others = [shape_text(text) for text in named if text]
    return given(arguments.shape, arguments.model, *others)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, arguments.output.with_suffix(".png")]
