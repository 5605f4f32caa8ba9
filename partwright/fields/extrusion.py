"""The extrusion: a profile moved along z, with straight or leaning walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from partwright.fields.base import LARGEST, checked, normalise, number
from partwright.fields.operations import library
from partwright.fields.profile import Profile
from partwright.fields.profile_distance import profile_distance, profile_gradients
from partwright.fields.profile_offset import Wall, offset
from partwright.fields.swept import Swept, SweptGradients

_STEEPEST = 89.0
_TINY = 1e-30


@dataclass(frozen=True)
class Extrusion(Swept):
    """The profile from z = -height/2 to z = height/2.

    taper: degrees by which walls lean inwards on their way up (the draft of a mould). At a height h above the
    bottom lies what is at least h tan(taper) deep within the profile, so lines become planes, arcs cones, and
    corners that point inwards are rounded. Every side has to reach the top.

    Without taper the distance is exact. With taper it is wherever the nearest point lies on a wall that the
    nearest side of the profile makes, and beyond the edges between walls it never exceeds the true one.

    Raises:
        ParameterError: the height is not positive, the taper is not from 0 to 89 degrees, or too much for the
            profile.
    """

    kind: ClassVar[str] = "extrusion"
    profile: Profile
    height: float
    taper: float = 0.0

    def __post_init__(self) -> None:
        self._check_profile()
        normalise(self, height=number(self, "height", 0.0, LARGEST, above=True))
        normalise(self, taper=number(self, "taper", 0.0, _STEEPEST))
        if self.taper:
            _ = self.top

    @cached_property
    def top(self) -> Profile:
        """The cross-section at z = height/2."""
        return self._walls[0]

    @property
    def walls(self) -> list[list[Wall]]:
        """How the top's sides grow out of the profile's, loop by loop; only with a taper."""
        return self._walls[1]

    @cached_property
    def _walls(self) -> tuple[Profile, list[list[Wall]]]:
        if not self.taper:
            return self.profile, []
        return offset(self.profile, self.height * math.tan(math.radians(self.taper)))

    @property
    def wall(self) -> float:
        return self.height

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        directions = np.asarray(directions, dtype=np.float64)
        ends = [
            profile.support(directions[:, :2]) + z * directions[:, 2]
            for profile, z in ((self.profile, -self.height / 2), (self.top, self.height / 2))
        ]
        return np.asarray(np.maximum(*ends) + level)

    def scaled(self, factor: float) -> Extrusion:
        factor = checked(f"{self.kind}: scale factor", factor, 0.0, LARGEST, above=True)
        return Extrusion(self.profile.scaled(factor), factor * self.height, self.taper)

    def _distance(self, points: Any) -> Any:
        return self._folded(profile_distance(self.profile, points[:, :2]), points[:, 2] + self.height / 2)

    def _folded(self, q: Any, z: Any) -> Any:
        """From the distances to the profile and heights above the bottom, both (N,): to the quad between the
        wall from (0, 0) to (-lean, height) and the two ends."""
        xp, (sine, cosine, lean, slant) = library(q), self._wall
        wall = q * cosine + z * sine
        along = z * cosine - q * sine
        inside = xp.maximum(wall, xp.maximum(-z, z - self.height))
        low = xp.sqrt(xp.clip(q, 0.0, None) ** 2 + z * z + _TINY)
        high = xp.sqrt(xp.clip(q + lean, 0.0, None) ** 2 + (z - self.height) ** 2 + _TINY)
        outside = xp.where(along < 0, low, xp.where(along > slant, high, wall))
        outside = xp.where((z <= 0) & (q <= 0), -z, outside)
        outside = xp.where((z >= self.height) & (q <= -lean), z - self.height, outside)
        return xp.where(inside <= 0, inside, outside)

    @property
    def _wall(self) -> tuple[float, float, float, float]:
        """Sine and cosine of the taper, how far in the top lies, and the wall's length."""
        angle = math.radians(self.taper)
        lean = self.height * math.tan(angle)
        return math.sin(angle), math.cos(angle), lean, math.hypot(lean, self.height)

    def gradients(self, points: np.ndarray, upstream: np.ndarray) -> SweptGradients:
        points, upstream = np.asarray(points, np.float64), np.asarray(upstream, np.float64)
        q, z = profile_distance(self.profile, points[:, :2]), points[:, 2] + self.height / 2
        by_q, by_height, by_angle = self._slopes(q, z)
        corners, _ = profile_gradients(self.profile, points[:, :2], upstream * by_q)
        numbers = [upstream @ by_height, upstream @ by_angle * math.pi / 180]
        return SweptGradients(corners, np.array(numbers))

    def _slopes(self, q: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the distance by q, by the height (which moves both ends apart), and by the taper's angle."""
        (sine, cosine, lean, slant), height = self._wall, self.height
        wall, along = q * cosine + z * sine, z * cosine - q * sine
        inside = np.maximum.reduce([wall, -z, z - height]) <= 0
        ends = np.maximum(-z, z - height)
        flat = np.where(inside, ends > wall, ((z <= 0) & (q <= 0)) | ((z >= height) & (q <= -lean)))
        low = ~inside & ~flat & (along < 0)
        high = ~inside & ~flat & (along > slant)
        by_q = np.where(flat, 0.0, cosine)
        by_height = np.where(flat, -0.5, sine / 2)
        by_angle = np.where(flat, 0.0, z * cosine - q * sine)
        over, up = q + lean, z - height
        below, above = (np.maximum(np.hypot(*pair), _TINY) for pair in ((q, z), (over, up)))
        by_q = np.where(low, q / below, np.where(high, over / above, by_q))
        tangent = lean / height
        rim = (over * tangent - up / 2) / above
        by_height = np.where(low, z / (2 * below), np.where(high, rim, by_height))
        by_angle = np.where(low, 0.0, np.where(high, over * height / cosine**2 / above, by_angle))
        return by_q, by_height, by_angle
