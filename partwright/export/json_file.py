"""The assembly file itself: everything, exactly."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from partwright.export.formats import Format, Holds

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path) -> None:
    """Write docs/assembly-file.md's format."""
    assembly.save(path)


FORMAT = Format("Assembly file", write, frozenset(Holds), empty=True)
