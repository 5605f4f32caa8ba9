"""What stands for a part otherwise than the part itself, and how far off that is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from partwright.approximation.nearest import Approximation
    from partwright.assembly import Part


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
