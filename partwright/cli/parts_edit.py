"""`partwright parts edit`: single parts swapped, moved, turned, scaled or dropped; the others adapt."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright.cli.outputs import add_output, given

if TYPE_CHECKING:
    from partwright.partsdf.neural import NeuralShape

_EPILOG = """\
SHAPE is an assembly of neural parts (.json), as `parts reconstruct` writes them, or MODEL:NAME for a shape
that a model was trained on, by name or number: mixers:3. Lengths are those of the unit frame, whose longest
side is 1.8. Edits are done in the order in which they are given.
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
    command.add_argument("shape", metavar="SHAPE", help="an assembly (.json) or MODEL:NAME")
    add_output(command, "FILE", "assembly (.json)", reads=_reads, writes=_writes)
    command.add_argument("--model", metavar="FILE", help="the model of SHAPE, if it does not ship")

    edits = command.add_argument_group("edits")

    def option(name: str, metavar: str, text: str) -> None:
        edits.add_argument(name, metavar=metavar, action=_Edit, dest="edits", default=[], help=text)

    option("--swap", "PART=SHAPE", "take the part's form from another shape of the same model")
    option("--resample", "PART=SEED", "give the part a random form")
    option("--move", "PART=X,Y,Z", "move the part")
    option("--turn", "PART=X,Y,Z,DEGREES", "turn the part about its centre, around an axis")
    option("--scale", "PART=X,Y,Z", "stretch the part along its own axes")
    option("--drop", "PART", "leave the part out, as if the shape had never had it")
    command.set_defaults(run=run)


def _reads(arguments: argparse.Namespace) -> list[Path]:
    others = [text.partition("=")[2] for name, text in arguments.edits if name == "swap"]
    return given(arguments.shape, arguments.model, *others)


def _writes(arguments: argparse.Namespace) -> list[Path]:
    return [arguments.output, arguments.output.with_suffix(".png")]


def run(arguments: argparse.Namespace) -> int:
    from partwright.cli.progress import Work
    from partwright.cli.terminal import say
    from partwright.errors import UnsupportedFormatError
    from partwright.partsdf.pictures import picture
    from partwright.partsdf.sources import open_source
    from partwright.render import Camera, write_png

    if arguments.output.suffix != ".json":
        raise UnsupportedFormatError(f"{arguments.output}: an assembly is written as .json")
    still = arguments.output.with_suffix(".png")
    with Work("reading") as work:
        source = open_source(arguments.shape, arguments.model)
        shape = source.shape
        for name, text in arguments.edits:
            shape = _edited(shape, name, text)
        source.assembly(shape).save(arguments.output)
        work.stage("drawing")
        camera = Camera(up=source.up or "z")
        write_png(still, picture(shape, camera=camera, size=480, progress=work.show))
    say(f"{', '.join(shape.names())}: written to {arguments.output}, drawn in {still}")
    return 0


def _edited(shape: NeuralShape, name: str, text: str) -> NeuralShape:
    from partwright.partsdf import editing
    from partwright.partsdf.sources import open_source

    part, _, value = text.partition("=")
    if name == "drop":
        return editing.without(shape, text)
    if name == "swap":
        return editing.swapped(shape, part, open_source(value).shape)
    if name == "resample":
        (seed,) = _numbers(name, text, 1)
        return editing.resampled(shape, part, int(seed))
    if name == "turn":
        *axis, degrees = _numbers(name, text, 4)
        return editing.turned(shape, part, axis, degrees)
    change: Callable[[NeuralShape, str, Sequence[float]], NeuralShape]
    change = {"move": editing.moved, "scale": editing.scaled}[name]
    return change(shape, part, _numbers(name, text, 3))


def _numbers(name: str, text: str, count: int) -> list[float]:
    from partwright.errors import SettingError

    try:
        values = [float(v) for v in text.partition("=")[2].split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise SettingError(f"--{name} {text}: expected PART= and {count} numbers, separated by commas")
    return values
