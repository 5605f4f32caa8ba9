"""What `partwright clean` does."""

from __future__ import annotations

import argparse

from partwright.assembly import load_assembly
from partwright.cleaning import clean
from partwright.cleaning.cleaned_file import check_suffix, write_cleaned
from partwright.cli.progress import Work
from partwright.cli.tables import print_cleaned
from partwright.errors import SettingError
from partwright.shapes import load_shape


def run(arguments: argparse.Namespace) -> int:
    check_suffix(arguments.output)
    assembly = load_assembly(arguments.assembly)
    shape = None
    if arguments.shape is None and arguments.thickness is not None:
        raise SettingError("--thickness is of a shape: it needs --shape")
    if arguments.shape is not None:
        shape = load_shape(arguments.shape, assembly.unit, assembly.up, arguments.thickness)
    with Work("cleaning") as work:
        cleaned = clean(assembly, shape, arguments.clean_tolerance, told=work.stage)
    write_cleaned(cleaned, arguments.output)
    print_cleaned(cleaned, arguments.output)
    return 0
