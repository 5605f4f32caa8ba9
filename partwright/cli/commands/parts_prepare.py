"""What `partwright parts prepare` does."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.interrupts import INTERRUPTED, raising
from partwright.cli.progress import Count
from partwright.cli.terminal import note, say, warn
from partwright.datasets import Preparation, prepare


def run(arguments: argparse.Namespace) -> int:
    with raising(), Count("preparing") as count:
        try:
            made = prepare(
                arguments.source,
                arguments.output,
                count=arguments.count,
                samples=arguments.samples,
                parts=arguments.parts,
                held_out=arguments.test,
                seed=arguments.seed,
                workers=arguments.workers,
                up=arguments.up,
                progress=lambda step: count.show(step.done, step.total, step.shape),
            )
        except KeyboardInterrupt:
            note(
                f"interrupted; shapes that are done are kept in {arguments.output}, and the same command "
                "goes on from there"
            )
            return INTERRUPTED
    _report(made, arguments.output)
    return 0


def _report(made: Preparation, folder: Path) -> None:
    warn(f"{shape.name}, left out: {shape.reason}" for shape in made.refused)
    family = made.family
    counts = ", ".join(f"{len(family.split(name))} {name}" for name in ("train", "validation", "test"))
    say(f"{len(family)} shapes of {len(family.parts)} parts ({counts}): {folder}")
