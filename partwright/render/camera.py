"""Where a picture is taken from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from partwright.errors import SettingError

# Up axis -> the side that azimuth 0 looks at.
_FRONTS = {"x": (0.0, -1.0, 0.0), "y": (0.0, 0.0, 1.0), "z": (0.0, -1.0, 0.0)}


@dataclass(frozen=True)
class View:
    """A camera in its place: eye (3,), the picture's right, up and towards-the-viewer axes (3,), half-width and
    half-height of the picture at distance 1."""

    eye: np.ndarray
    right: np.ndarray
    up: np.ndarray
    back: np.ndarray
    half: tuple[float, float]

    def rays(self, width: int, height: int) -> np.ndarray:
        """(height * width, 3) float32 unit directions through the pixels' centres, row by row from the top."""
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * self.half[0]
        y = (1 - (np.arange(height) + 0.5) / height * 2) * self.half[1]
        rays = x[None, :, None] * self.right + y[:, None, None] * self.up - self.back
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        return rays.reshape(-1, 3).astype(np.float32)


@dataclass(frozen=True)
class Camera:
    """A direction to look from; the distance follows from what is to be seen.

    azimuth: degrees around the up axis, 0 the front (-y where z is up, +z where y is up), to the right.
    elevation: degrees above the horizon. field_of_view: degrees of the picture's height.
    up: "x", "y" or "z", with "-" in front if it points down. margin: share of the picture left free.
    """

    azimuth: float = 32.0
    elevation: float = 24.0
    field_of_view: float = 26.0
    up: str = "z"
    margin: float = 0.08

    def __post_init__(self) -> None:
        if self.up.removeprefix("-") not in _FRONTS:
            raise SettingError(f"The up axis is {self.up!r}; expected x, y or z, or one of them with a minus.")
        if not 1 <= self.field_of_view <= 120 or not 0 <= self.margin < 0.5:
            raise SettingError("A camera sees between 1 and 120 degrees, with a margin from 0 to 0.5.")

    @property
    def up_axis(self) -> np.ndarray:
        """(3,) unit vector."""
        axis = np.zeros(3)
        axis["xyz".index(self.up[-1])] = -1.0 if self.up.startswith("-") else 1.0
        return axis

    def fitted(self, points: np.ndarray, width: int, height: int) -> View:
        """The view that just holds all points (N, 3) and centres them in a picture of that shape."""
        up_axis, front = self.up_axis, np.array(_FRONTS[self.up[-1]])
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        side = np.cross(up_axis, front)
        level = math.cos(azimuth) * front + math.sin(azimuth) * side
        back = math.cos(elevation) * level + math.sin(elevation) * up_axis
        right = -math.sin(azimuth) * front + math.cos(azimuth) * side
        up = np.cross(back, right)

        tangent = math.tan(math.radians(self.field_of_view) / 2)
        half = (tangent * width / height, tangent)
        x, y, z = (points @ axis for axis in (right, up, back))
        distance, shift = 0.0, []
        for offset, share in ((x, half[0]), (y, half[1])):
            slope = share * (1 - 2 * self.margin)
            high, low = (slope * z + offset).max(), (slope * z - offset).max()
            distance = max(distance, (high + low) / (2 * slope))
            shift.append((high - low) / 2)
        return View(shift[0] * right + shift[1] * up + distance * back, right, up, back, half)
