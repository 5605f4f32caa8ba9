"""The assembly file itself: everything, exactly."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def write(assembly: Assembly, path: str | Path) -> None:
    """Write docs/assembly-file.md's format."""
    assembly.save(path)
