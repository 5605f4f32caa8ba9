"""What `partwright parts reconstruct` does."""

from __future__ import annotations

import argparse

from partwright.cli.interrupts import stopping
from partwright.cli.progress import Display, Work
from partwright.cli.tables import finish_fit
from partwright.cli.terminal import counted, say, warn
from partwright.errors import SettingError
from partwright.fitting import fit
from partwright.methods import Cancellation
from partwright.partsdf.from_photo import reconstruct_photo
from partwright.partsdf.method import METHOD
from partwright.partsdf.model import load_model
from partwright.shapes import PICTURE_SUFFIXES, load_shape

_SEARCH = ("iterations", "points", "start")
_OF_SHAPES = ("quality", *_SEARCH, "as_it_stands", "unit", "up", "thickness", "seed")  # not of pictures


def run(arguments: argparse.Namespace) -> int:
    if not arguments.model:
        raise SettingError("which model's parts? Name it before the shape, or as --model: --model chairs")
    if arguments.shape.suffix.lower() in PICTURE_SUFFIXES:
        return _of_picture(arguments)
    settings = METHOD.settings(
        arguments.quality or "normal",
        model=arguments.model,
        resolution=arguments.resolution,
        turn=not arguments.as_it_stands,
        **{name: getattr(arguments, name) for name in _given(arguments, _SEARCH)},
    )
    cancel = Cancellation()
    with Display() as display:
        shape = load_shape(arguments.shape, arguments.unit, arguments.up, arguments.thickness)
        with stopping(cancel.request):
            result = fit(shape, settings, seed=arguments.seed or 0, progress=display.show, cancel=cancel)
        display.stage("writing")
        result.save(arguments.output)
    return finish_fit(result, arguments.output)


def _of_picture(arguments: argparse.Namespace) -> int:
    if given := _given(arguments, _OF_SHAPES):
        option = given[0].replace("_", "-")
        raise SettingError(f"--{option} is for meshes and points; of a picture there is --resolution alone")
    with Work("looking") as work:
        found = reconstruct_photo(load_model(arguments.model), arguments.shape, arguments.resolution)
        work.stage("writing")
        found.save(arguments.output)
    camera, covered = found.report["camera"], found.report["silhouette_iou"]
    say(
        f"{counted(len(found.report['parts']), 'part')} of {found.shape.model.name} seen in "
        f"{arguments.shape.name}, from azimuth {camera['azimuth']:.0f}, elevation "
        f"{camera['elevation']:.0f}; silhouettes agree to {100 * covered:.0f} %: {arguments.output}"
    )
    warn(found.warnings)
    return 0


def _given(arguments: argparse.Namespace, names: tuple[str, ...]) -> list[str]:
    return [name for name in names if getattr(arguments, name) is not None]
