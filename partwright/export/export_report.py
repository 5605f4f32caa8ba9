"""FILE.report.json: what an export changed because its format cannot hold it, and how far off that is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.atomic_io import report_path, write_bytes
from partwright.errors import OutputError

if TYPE_CHECKING:
    from partwright.approximation.change import Change
    from partwright.assembly import Assembly


def write_report(
    assembly: Assembly, path: str | Path, changes: Sequence[Change], notes: Sequence[str] = (), **more: Any
) -> None:
    """Write FILE.report.json beside an export that changed something; remove one that no longer holds.

    notes: what else a reader should know. more: further entries, as JSON types.

    Raises:
        OutputError: it cannot be written, or removed.
    """
    target = report_path(path)
    if not changes:
        try:
            target.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"cannot remove the old report {target}: {error.strerror}") from error
        return
    report = {
        "file": Path(path).name,
        "version": __version__,
        "unit": assembly.unit,
        "parts": len(assembly),
        "approximated": [change.to_dict() for change in changes],
        "notes": list(notes),
    }
    write_bytes(target, (json.dumps(report | more, indent=2) + "\n").encode())
