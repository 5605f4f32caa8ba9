"""What `partwright texture` does."""

from __future__ import annotations

import argparse
import json
import time

from partwright import __version__
from partwright.assembly import load_assembly
from partwright.atomic_io import report_path, write_bytes
from partwright.cli.terminal import say
from partwright.errors import UnsupportedFormatError
from partwright.textures import bake_both, load_colours
from partwright.textures.likeness import SIDE, VIEWS, likeness, without_relief
from partwright.textures.maps import KEY, RELIEF


def run(arguments: argparse.Namespace) -> int:
    if arguments.output.suffix.lower() != ".json":
        raise UnsupportedFormatError(
            f"cannot write the maps to {arguments.output.name}: use a .json, then partwright export"
        )
    assembly = load_assembly(arguments.assembly)
    colours = load_colours(arguments.shape)
    start = time.process_time()
    plain, baked = bake_both(assembly, colours, arguments.size)
    seconds = time.process_time() - start
    before, after = likeness([plain, baked], colours)
    smooth, bent = likeness([without_relief(baked), baked], colours, lit=True)
    report = {
        "file": arguments.output.name,
        "version": __version__,
        "texels_a_side": arguments.size,
        "cpu_seconds": round(seconds, 2),
        "psnr": {"views": VIEWS, "side": SIDE, "before": _told(before), "after": _told(after)},
        "psnr_lit": {"smooth": _told(smooth), "normal_maps": _told(bent)},
        "normal_maps": sum(RELIEF in part.metadata for part in baked.parts),
    }
    baked.save(arguments.output)
    write_bytes(report_path(arguments.output), (json.dumps(report, indent=2) + "\n").encode())
    count = sum(KEY in part.metadata for part in baked.parts)
    size = arguments.output.stat().st_size / 1000
    said = f"wrote {arguments.output}: {len(baked)} parts, {count} with a map, {size:.3g} kB"
    say(f"{said}; PSNR of {VIEWS} views {after[0]:.1f} dB, {before[0]:.1f} before they were optimised")
    return 0


def _told(scores: tuple[float, float]) -> dict[str, float]:
    """In dB."""
    return {"pictures": round(scores[0], 2), "surface": round(scores[1], 2)}
