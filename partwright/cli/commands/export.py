"""What `partwright export` does."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.assembly import load_assembly
from partwright.atomic_io import report_path
from partwright.cli.terminal import say
from partwright.export import export
from partwright.export.export_report import approximated_parts
from partwright.export.formats import format_of

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
    say(_what_was_written(arguments.output, len(assembly)))
    return 0


def _what_was_written(path: Path, parts: int) -> str:
    """One line: the file, its format and size, and what of the assembly it could not hold."""
    line = f"wrote {path}: {format_of(path).name}, {path.stat().st_size / 1000:.3g} kB"
    changed = len(approximated_parts(path))
    if not changed:
        return line
    which = f"{changed} of {parts} parts"
    if changed == parts:
        which = "the part" if parts == 1 else f"all {parts} parts"
    verb = "is" if changed == 1 else "are"
    return f"{line}; {which} {verb} approximated, see {report_path(path)} for how far off"
