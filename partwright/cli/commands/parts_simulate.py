"""What `partwright parts simulate` does."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh

from partwright.batch.items import items_of
from partwright.cli.interrupts import INTERRUPTED, raising
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, note, say, warn
from partwright.datasets.families import FAMILIES, family
from partwright.errors import PartwrightError, SettingError, SimulationError
from partwright.goals.flow.air import Air
from partwright.goals.flow.dataset import Done, simulate_all
from partwright.goals.flow.programs import check_installed
from partwright.shapes import METRES, load_shape

_CENTIMETRES = 0.01  # of made families


def run(arguments: argparse.Namespace) -> int:
    made = arguments.source in FAMILIES
    air = Air.of(arguments.air)
    check_installed()
    if made:
        count, bodies = arguments.count, _family(arguments)
    else:
        files = [item.file for item in items_of(Path(arguments.source), without=arguments.output)]
        if not files:
            raise SettingError(f"{arguments.source}: expected a folder with shapes; there is none")
        count, bodies = len(files), _folder(Path(arguments.source), files)
    with raising(), Count("simulating") as progress:
        try:
            done = simulate_all(
                bodies, arguments.output, air, lambda one: progress.show(one.number, count, _said(one))
            )
        except KeyboardInterrupt:
            note(f"interrupted; what is done is kept in {arguments.output}, and the same command goes on")
            return INTERRUPTED
    failed = [one for one in done if one.reason]
    warn(f"{one.name} is left out: {one.reason}" for one in failed)
    if len(failed) == len(done):
        raise SimulationError(f"none of {counted(len(done), 'shape')} could be simulated")
    say(f"{len(done) - len(failed)} of {counted(len(done), 'shape')} simulated: {arguments.output}")
    return 0


def _family(arguments: argparse.Namespace) -> Iterator[tuple[str, trimesh.Trimesh]]:
    for shape in family(arguments.source, arguments.count, arguments.seed):
        yield (
            shape.name,
            trimesh.Trimesh(_CENTIMETRES * shape.whole.vertices, shape.whole.faces, process=False),
        )


def _folder(folder: Path, files: list[str]) -> Iterator[tuple[str, trimesh.Trimesh]]:
    for file in files:
        try:
            shape = load_shape(folder / file)
        except PartwrightError as error:
            warn([f"{file} is left out: {error}"])
            continue
        metres = METRES.get(shape.unit or "m", 1.0)
        yield file, trimesh.Trimesh(metres * np.asarray(shape.vertices), shape.faces, process=False)


def _said(one: Done) -> str:
    return f"{one.name}  {one.reason or f'{one.drag_area:.4g} m2'}" + ("" if one.made else "  (known)")
