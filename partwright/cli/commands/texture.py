"""What `partwright texture` does."""

from __future__ import annotations

import argparse

from partwright.assembly import load_assembly
from partwright.cli.terminal import say
from partwright.errors import UnsupportedFormatError
from partwright.textures import bake, load_colours
from partwright.textures.maps import KEY


def run(arguments: argparse.Namespace) -> int:
    if arguments.output.suffix.lower() != ".json":
        raise UnsupportedFormatError(
            f"cannot write the maps to {arguments.output.name}: use a .json, then partwright export"
        )
    assembly = load_assembly(arguments.assembly)
    baked = bake(assembly, load_colours(arguments.shape), arguments.size)
    baked.save(arguments.output)
    count = sum(KEY in part.metadata for part in baked.parts)
    size = arguments.output.stat().st_size / 1000
    say(f"wrote {arguments.output}: {len(baked)} parts, {count} with a map, {size:.3g} kB")
    return 0
