"""The ellipsoid: no SuperFrustum, but a solid that physics engines know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np

from partwright.fields import Field
from partwright.fields.base import LARGEST, normalise, scale_lengths, vector


@dataclass(frozen=True)
class Ellipsoid(Field):
    """An ellipsoid of these semi-axes. Its distance is exact on the surface and first order beside it."""

    kind: ClassVar[str] = "ellipsoid"
    radii: tuple[float, float, float]

    def __post_init__(self) -> None:
        normalise(self, radii=vector(self, "radii", 0.0, LARGEST))

    def __call__(self, points: Any) -> Any:
        """f/|grad f| of f = |p/r| - 1, which is k (k - 1)/|p/r^2| with k = |p/r| (Quilez 2008)."""
        scaled = points / np.asarray(self.radii, dtype=points.dtype)
        level = np.linalg.norm(scaled, axis=1)
        slope = np.linalg.norm(scaled / np.asarray(self.radii, dtype=points.dtype), axis=1)
        centre = -np.float32(min(self.radii))
        return np.divide(
            level * (level - 1), slope, out=np.full(len(points), centre, points.dtype), where=slope > 0
        )

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return -np.array(self.radii), np.array(self.radii)

    def scaled(self, factor: float) -> Ellipsoid:
        return cast(Ellipsoid, scale_lengths(self, factor, ("radii",)))
