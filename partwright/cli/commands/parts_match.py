"""What `partwright parts match` does."""

from __future__ import annotations

import argparse

from partwright.batch.unlabelled import PICTURE, find_parts, meshes_of, write_found
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, say, warn
from partwright.errors import SettingError
from partwright.methods import Progress


def run(arguments: argparse.Namespace) -> int:
    if not 0 < arguments.common <= 1:
        raise SettingError(f"--common is {arguments.common}; expected a share above 0, at most 1")
    files = meshes_of(arguments.source)
    done: set[int] = set()
    with Count("fitting") as count:

        def told(index: int, step: Progress) -> None:
            if step.fraction >= 1:
                done.add(index)
            count.show(len(done), len(files), files[index].stem)

        found = find_parts(
            files,
            common=arguments.common,
            at_once=arguments.at_once,
            progress=told,
            quality=arguments.quality,
            seed=arguments.seed,
        )
    write_found(arguments.output, found)
    warn(f"{one.name} is left out: {one.reason}" for one in found.refused)
    for part, share in zip(found.parts, found.matching.filled, strict=True):
        say(f"{part}: in {share:.0%} of {counted(len(found.shapes), 'shape')}")
    say(f"{counted(len(found.parts), 'part')} in {arguments.output}; look at {arguments.output / PICTURE}")
    return 0
