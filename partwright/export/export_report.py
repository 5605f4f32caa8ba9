"""FILE.report.json: what an export changed because its format cannot hold it, and how far off that is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.approximation.solid_tree import HOLE
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
        "approximated_parts": _own_names(assembly, changes),
        "approximated": [change.to_dict() for change in changes],
        "notes": list(notes),
    }
    write_bytes(report_path(path), (json.dumps(report | more, indent=2) + "\n").encode())


def approximated_parts(path: str | Path) -> list[str]:
    """Names of the assembly's parts that an export to `path` changed, or a copy of them, by its report; none
    where it has no report."""
    target = report_path(path)
    if not target.exists():
        return []
    names: list[str] = json.loads(target.read_text("utf-8"))["approximated_parts"]
    return names


def _own_names(assembly: Assembly, changes: Sequence[Change]) -> list[str]:
    """Of the assembly's own parts: a format may hold each copy, and each hole, under a name of its own."""
    copies = [part.name for part in assembly.expanded().parts]
    owner = dict(zip(copies, (part.name for part in assembly.parts for _ in part.copies), strict=True))
    changed = {name for change in changes for name in change.what}
    changed |= {name.removesuffix(HOLE) for name in changed - owner.keys()}
    found = {own for name, own in owner.items() if name in changed}
    return [part.name for part in assembly.parts if part.name in found]
