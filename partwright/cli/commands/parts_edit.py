"""What `partwright parts edit` does."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence

from partwright.cli.assembly_argument import shape_text
from partwright.cli.progress import Work
from partwright.cli.terminal import say
from partwright.errors import SettingError, UnsupportedFormatError
from partwright.partsdf import editing
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.pictures import picture
from partwright.partsdf.sources import open_source
from partwright.render import Camera, write_png


def run(arguments: argparse.Namespace) -> int:
    if arguments.output.suffix != ".json":
        raise UnsupportedFormatError(f"{arguments.output}: an assembly is written as .json")
    still = arguments.output.with_suffix(".png")
    with Work("reading") as work:
        source = open_source(arguments.shape, arguments.model)
        shape = source.shape
        for name, text in arguments.edits:
            shape = _edited(shape, name, text)
        assembly = source.assembly(shape)
        work.stage("drawing")
        camera = Camera(up=source.up or "z")
        # Before anything is written, as it may not be possible.
        drawn = picture(shape, camera=camera, size=480, progress=work.show)
        assembly.save(arguments.output)
        write_png(still, drawn)
    say(f"{', '.join(shape.names())}: written to {arguments.output}, drawn in {still}")
    return 0


def _edited(shape: NeuralShape, name: str, text: str) -> NeuralShape:
    part, _, value = text.partition("=")
    if name == "drop":
        return editing.without(shape, text)
    if name == "swap":
        if not part or not value:
            raise SettingError(f"--swap {text}: expected PART=SHAPE, as seat=chairs:3 or seat=other.json")
        return editing.swapped(shape, part, open_source(shape_text(value)).shape)
    if name == "resample":
        return editing.resampled(shape, part, _seed(text))
    if name == "turn":
        *axis, degrees = _numbers(name, text, 4)
        return editing.turned(shape, part, axis, degrees)
    change: Callable[[NeuralShape, str, Sequence[float]], NeuralShape]
    change = {"move": editing.moved, "scale": editing.scaled}[name]
    return change(shape, part, _numbers(name, text, 3))


def _numbers(name: str, text: str, count: int) -> list[float]:
    try:
        values = [float(v) for v in text.partition("=")[2].split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise SettingError(f"--{name} {text}: expected PART= and {count} numbers, separated by commas")
    return values


def _seed(text: str) -> int:
    _, _, value = text.partition("=")
    if not value.isdecimal():
        raise SettingError(f"--resample {text}: expected PART= and a seed, a whole number of at least 0")
    return int(value)
