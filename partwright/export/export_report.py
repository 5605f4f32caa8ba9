"""FILE.report.json: what an export changed because its format cannot hold it, and how far off that is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.atomic_io import report_path, write_bytes

if TYPE_CHECKING:
    from partwright.approximation.change import Change
    from partwright.assembly import Assembly


def write_report(
    assembly: Assembly, path: str | Path, changes: Sequence[Change], notes: Sequence[str] = (), **more: Any
) -> None:
    """Write FILE.report.json beside an export that changed something, and none beside any other.

    notes: what else a reader should know. more: further entries, as JSON types.

    Raises:
        OutputError: it cannot be written.
    """
    if not changes:
        return
    report = {
        "file": Path(path).name,
        "version": __version__,
        "unit": assembly.unit,
        "parts": len(assembly),
        "approximated": [change.to_dict() for change in changes],
        "notes": list(notes),
    }
    write_bytes(report_path(path), (json.dumps(report | more, indent=2) + "\n").encode())


def approximated_parts(path: str | Path) -> list[str]:
    """Names of the parts that an export to `path` changed, by its report; none where it has no report."""
    target = report_path(path)
    if not target.exists():
        return []
    changes = json.loads(target.read_text("utf-8")).get("approximated", [])
    return list(dict.fromkeys(name for change in changes for name in change["parts"]))
