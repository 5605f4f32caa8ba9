"""What `partwright parts interpolate` does."""

from __future__ import annotations

import argparse

from partwright.cli.progress import Work
from partwright.cli.terminal import say
from partwright.partsdf.pictures import check_film, film
from partwright.partsdf.sources import open_source
from partwright.render import Camera


def run(arguments: argparse.Namespace) -> int:
    check_film(arguments.output, arguments.steps)
    with Work("reading") as work:
        first = open_source(arguments.first, arguments.model)
        second = open_source(arguments.second)
        work.stage("drawing")
        still = film(
            first.shape,
            second.shape,
            arguments.output,
            arguments.steps,
            arguments.resolution,
            arguments.size,
            Camera(up=first.up or "z"),
            work.show,
        )
    say(f"written to {arguments.output}, sheet in {still}")
    return 0
