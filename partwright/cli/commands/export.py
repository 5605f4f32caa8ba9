"""What `partwright export` does."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.assembly import load_assembly
from partwright.atomic_io import report_path
from partwright.cli.terminal import say
from partwright.export import export
from partwright.export.export_report import approximated_parts
from partwright.export.formats import FORMATS, Holds, format_of

if TYPE_CHECKING:
    from partwright.assembly import Assembly

# Options of formats; those not given are left to the format.
_OPTIONS = (
    "density",
    "tolerance",
    "free_joint",
    "physics",
    "links",
    "visuals",
    "by_part",
    "joined",
    "resolution",
    "facets",
    "separate",
)


def run(arguments: argparse.Namespace) -> int:
    given = {name: getattr(arguments, name) for name in _OPTIONS}
    options = {name: value for name, value in given.items() if value is not None}
    assembly = load_assembly(arguments.assembly)
    export(assembly, arguments.output, **options)
    say(_what_was_written(arguments.output, assembly))
    return 0


def _what_was_written(path: Path, assembly: Assembly) -> str:
    """One line: the file, its format and size, and what of the assembly it could not hold."""
    form = format_of(path)
    line = f"wrote {path}: {form.name}, {path.stat().st_size / 1000:.3g} kB"
    if bare := len(form.lost_maps(assembly)):
        able = dict.fromkeys(f.name for f in map(FORMATS.__getitem__, FORMATS.own) if Holds.MAPS in f.holds)
        maps = "map" if bare == 1 else "maps"
        line += f"; without the {maps} of {_of(bare, len(assembly))}, which {', '.join(able)} can hold"
    if changed := len(approximated_parts(path)):
        verb = "is" if changed == 1 else "are"
        line += (
            f"; {_of(changed, len(assembly))} {verb} approximated, see {report_path(path)} for how far off"
        )
    return line


def _of(some: int, parts: int) -> str:
    """So many of the parts, in words."""
    if some < parts:
        return f"{some} of {parts} parts"
    return "the part" if parts == 1 else f"all {parts} parts"
