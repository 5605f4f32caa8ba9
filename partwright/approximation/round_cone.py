"""The round cone: the convex hull of two spheres, which glTF and USD have as a capsule with two radii."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np

from partwright.errors import ParameterError
from partwright.fields import Field
from partwright.fields.base import LARGEST, normalise, number, scale_lengths


@dataclass(frozen=True)
class RoundCone(Field):
    """Spheres of these radii about z = -height/2 and z = height/2, and all between. Its distance is exact."""

    kind: ClassVar[str] = "round_cone"
    bottom_radius: float
    top_radius: float
    height: float

    def __post_init__(self) -> None:
        names = ("bottom_radius", "top_radius", "height")
        normalise(self, **{name: number(self, name, 0.0, LARGEST, above=True) for name in names})
        if abs(self.bottom_radius - self.top_radius) >= self.height:
            raise ParameterError("round_cone: one sphere is within the other; expected a greater height")

    def __call__(self, points: Any) -> Any:
        """In the half plane of axis and point: to a sphere, or to the tangent of both."""
        across = np.hypot(points[:, 0], points[:, 1])
        along = points[:, 2] + points.dtype.type(self.height / 2)
        lean = (self.bottom_radius - self.top_radius) / self.height
        rise = math.sqrt(1 - lean**2)
        place = along * points.dtype.type(rise) - across * points.dtype.type(lean)
        side = across * points.dtype.type(rise) + along * points.dtype.type(lean)
        low = np.hypot(across, along) - points.dtype.type(self.bottom_radius)
        high = np.hypot(across, along - points.dtype.type(self.height)) - points.dtype.type(self.top_radius)
        middle = side - points.dtype.type(self.bottom_radius)
        return np.where(place < 0, low, np.where(place > rise * self.height, high, middle))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        wide, half = max(self.bottom_radius, self.top_radius), self.height / 2
        low, high = (
            min(-half - self.bottom_radius, half - self.top_radius),
            max(half + self.top_radius, self.bottom_radius - half),
        )
        return np.array([-wide, -wide, low]), np.array([wide, wide, high])

    def scaled(self, factor: float) -> RoundCone:
        return cast(RoundCone, scale_lengths(self, factor, ("bottom_radius", "top_radius", "height")))
