"""Where a picture is taken from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from partwright.errors import SettingError
from partwright.rows import corners
from partwright.shapes.units import axis_vector

# Up axis -> the side that azimuth 0 looks at.
_FRONTS = {"x": (0.0, -1.0, 0.0), "y": (0.0, 0.0, 1.0), "z": (0.0, -1.0, 0.0)}

_NEAREST = 0.5  # of the longest side, between the eye and the nearest point


def picture_axes(up: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """To the right, up and towards the viewer, (3,) each, as seen from the front. up: "x", "-y" ...

    Raises SettingError for another axis.
    """
    if up.removeprefix("-") not in _FRONTS:
        raise SettingError(f"The up axis is {up!r}; expected x, y or z, or one of them with a minus.")
    above = axis_vector(up)
    front = np.array(_FRONTS[up[-1]])
    return np.cross(above, front), above, front


@dataclass(frozen=True)
class View:
    """A camera in its place: eye (3,), the picture's right, up and towards-the-viewer axes (3,), half-width
    and half-height of the picture at distance 1."""

    eye: np.ndarray
    right: np.ndarray
    up: np.ndarray
    back: np.ndarray
    half: tuple[float, float]

    def rays(self, width: int, height: int) -> np.ndarray:
        """(height * width, 3) float32 unit directions through the pixels' centres, by rows from the top."""
        x, y = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
        return self.through(np.tile(x, height), np.repeat(y, width))

    def through(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(N, 3) float32 unit directions through places (N,) of the picture, 0 to 1 from its left and top."""
        right, up = (
            ((2 * x - 1) * self.half[0]).astype(np.float32),
            ((1 - 2 * y) * self.half[1]).astype(np.float32),
        )
        rays = np.empty((len(x), 3), np.float32)
        for i in range(3):
            rays[:, i] = right * self.right[i] + up * self.up[i] - self.back[i]
        rays /= np.sqrt(1 + right * right + up * up)[:, None]
        return rays


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
        picture_axes(self.up)
        if not 1 <= self.field_of_view <= 120 or not 0 <= self.margin < 0.5:
            raise SettingError("A camera sees between 1 and 120 degrees, with a margin from 0 to 0.5.")

    @property
    def up_axis(self) -> np.ndarray:
        """(3,) unit vector."""
        return picture_axes(self.up)[1]

    def framed(self, points: np.ndarray, side: int, least: int) -> tuple[int, int]:
        """Width and height of a picture that these points (N, 3) fill.

        It has about side * side pixels, and no side under `least`.
        """
        view = self.fitted(points, side, side)
        wide, high = (np.ptp(points @ axis) for axis in (view.right, view.up))
        stretch = math.sqrt(min(max(wide / max(high, 1e-9 * wide), (least / side) ** 2), (side / least) ** 2))
        return round(side * stretch), round(side / stretch)

    def fitted(self, points: np.ndarray, width: int, height: int) -> View:
        """The view that just holds all points (N, 3) and centres them in a picture of that shape."""
        side, up_axis, front = picture_axes(self.up)
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        level = math.cos(azimuth) * front + math.sin(azimuth) * side
        back = math.cos(elevation) * level + math.sin(elevation) * up_axis
        right = -math.sin(azimuth) * front + math.cos(azimuth) * side
        up = np.cross(back, right)

        tangent = math.tan(math.radians(self.field_of_view) / 2)
        half = (tangent * width / height, tangent)
        lowest, highest = corners(points)
        middle = (lowest + highest) / 2
        centred = points - middle
        x, y, z = (centred @ axis for axis in (right, up, back))
        # Not at the very tip of a needle that points at the viewer.
        distance, shift = z.max() + _NEAREST * (highest - lowest).max(), []
        for offset, share in ((x, half[0]), (y, half[1])):
            slope = share * (1 - 2 * self.margin)
            high, low = (slope * z + offset).max(), (slope * z - offset).max()
            distance = max(distance, (high + low) / (2 * slope))
            shift.append((high - low) / 2)
        eye = middle + shift[0] * right + shift[1] * up + distance * back
        return View(eye, right, up, back, half)
