"""One number that a search may change."""

from __future__ import annotations

import math
from dataclasses import dataclass

POSITION, ROTATION, FORM, BLEND, LATENT = "position", "rotation", "form", "blend", "latent"
GROUPS = (POSITION, ROTATION, FORM, BLEND, LATENT)
MOST = 5.0  # unit of a share or an angle: what is small turns and bends by no more in a step


@dataclass(frozen=True)
class Entry:
    """A parameter of a part.

    group: position, rotation, form, blend or latent. unit: by how much it changes where the surface moves by
    about the assembly's longest side; steps are taken in these, so that they compare. lower, upper: what the
    field allows.
    """

    name: str
    group: str
    value: float
    unit: float
    lower: float = -math.inf
    upper: float = math.inf
