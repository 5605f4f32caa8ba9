"""What `partwright parts reconstruct` does."""

from __future__ import annotations

import argparse

from partwright.cli.interrupts import stopping
from partwright.cli.progress import Display
from partwright.cli.tables import finish_fit
from partwright.fitting import fit
from partwright.methods import Cancellation
from partwright.partsdf.settings import Settings
from partwright.shapes import load_shape


def run(arguments: argparse.Namespace) -> int:
    settings = Settings(
        arguments.model,
        arguments.resolution,
        iterations=arguments.iterations,
        points=arguments.points,
        start=arguments.start,
        turn=not arguments.as_it_stands,
    )
    cancel = Cancellation()
    with Display() as display:
        shape = load_shape(arguments.shape, unit=arguments.unit, up=arguments.up)
        with stopping(cancel.request):
            result = fit(shape, settings, seed=arguments.seed, progress=display.show, cancel=cancel)
        display.stage("writing")
        result.save(arguments.output)
    return finish_fit(result, arguments.output)
