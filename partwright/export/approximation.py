"""FILE.report.json: what an export changed because its format cannot hold it, and how far off that is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.atomic_io import write_bytes
from partwright.errors import OutputError

if TYPE_CHECKING:
    from partwright.assembly import Assembly, Part
    from partwright.export.nearest import Approximation


@dataclass(frozen=True)
class Change:
    """One thing that the file holds otherwise than the assembly.

    what: names of the parts. to: what stands for them: a solid's kind, "mesh", "nothing".
    volume_error_ratio: volume in one of the two only, over the assembly's own.
    max_deviation: of the surfaces, in the assembly's unit. Both None where they were not measured.
    """

    what: tuple[str, ...]
    to: str
    volume_error_ratio: float | None = None
    max_deviation: float | None = None
    blend_dropped: float = 0.0
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        own: dict[str, Any] = {"parts": list(self.what), "to": self.to}
        for name in ("volume_error_ratio", "max_deviation"):
            value = getattr(self, name)
            if value is not None:
                own[name] = float(f"{value:.6g}")
        own["blend_dropped"] = self.blend_dropped
        return own | ({"note": self.note} if self.note else {})


def of_part(part: Part, near: Approximation, blend: float, length: float = 1.0) -> Change | None:
    """The change that a solid in a part's stead is, without its blend; None where it is none.

    length: of the parts' unit of length in the unit that changes are to be told in, as `blend` is.
    """
    if near.exact and blend == 0.0:
        return None
    kind = near.solid.kind
    return Change((part.name,), kind, near.volume_error_ratio, near.max_deviation * length, blend)


def report_path(path: str | Path) -> Path:
    return Path(path).with_name(Path(path).name + ".report.json")


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
