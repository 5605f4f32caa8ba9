"""Fits that are there already, shape by shape, for tables of what becomes of them."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from fit import Entry, find_shapes, machine

RESULTS = Path(__file__).parent / "results"


def parser(about: str | None, table: str) -> argparse.ArgumentParser:
    """--shapes, --sets, --fits and --output, by default a table's place among the results."""
    result = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    option = result.add_argument
    option("--shapes", type=Path, required=True, metavar="FOLDER", help="an index.json, or meshes")
    option("--sets", default="cad", metavar="A,B", help="only these sets (default: %(default)s)")
    option("--fits", type=Path, required=True, metavar="FOLDER", help="fits, as FOLDER/NAME/assembly.json")
    option("-o", "--output", type=Path, default=RESULTS / table, metavar="FILE")
    return result


def fits(options: argparse.Namespace) -> Iterator[tuple[Entry, Path]]:
    """The shapes that have a fit, each with its assembly."""
    for entry in find_shapes(options.shapes, {*filter(None, options.sets.split(","))}, set()):
        path = options.fits / entry.name / "assembly.json"
        if path.exists():
            yield entry, path


def command(script: str, options: argparse.Namespace) -> str:
    """What made a table, and where."""
    return (
        f"`python benchmarks/{script} --shapes {options.shapes.name} --sets {options.sets} --fits "
        f"{options.fits.name}` on {machine()}."
    )
