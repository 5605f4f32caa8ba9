"""A cleaned assembly on disk: the assembly file, and what was found beside it."""

from __future__ import annotations

import json
from pathlib import Path

from partwright import __version__
from partwright.atomic_io import report_path, write_bytes
from partwright.cleaning.pipeline import Cleaned
from partwright.errors import NothingToCleanError, UnsupportedFormatError


def check_suffix(path: str | Path) -> None:
    """Raises UnsupportedFormatError unless FILE is an assembly file: cleaning comes before any export."""
    if Path(path).suffix.lower() != ".json":
        raise UnsupportedFormatError(
            f"cannot write the clean assembly to {Path(path).name}: use a .json, then partwright export"
        )


def write_cleaned(cleaned: Cleaned, path: str | Path) -> None:
    """Write the assembly to `path` (.json), and FILE.report.json with tolerance, scores and relations.

    Raises:
        NothingToCleanError: nothing has changed, so there is nothing to write.
        UnsupportedFormatError: the suffix is another.
        OutputError: they cannot be written.
    """
    check_suffix(path)
    if not cleaned.changed:
        raise NothingToCleanError(
            f"nothing to clean: all numbers are plain already, or what is nearly so costs more than "
            f"{cleaned.tolerance:.3g}; nothing was written"
        )
    cleaned.assembly.save(path)
    report = {"file": Path(path).name, "version": __version__, "unit": cleaned.assembly.unit}
    text = json.dumps(report | cleaned.to_dict(), indent=2) + "\n"
    write_bytes(report_path(path), text.encode())
