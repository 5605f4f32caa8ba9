"""A camera whose every number may be a little different: what fits to a picture move, beside its shape."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from partwright.render.camera import Camera, picture_axes

NUMBERS = 7
NEAR = 3  # which of them is the reciprocal of the distance
_NEAREST, _FARTHEST = 0.55, 0.02  # of it: outside of the unit frame's corners, and almost parallel rays
_CELLS, _STEP = 64, 1e-5
_LEAST, _WIDEST = 5.0, 60.0  # degrees of a picture that a person looks at


@dataclass(frozen=True)
class Pinhole:
    """numbers (7,): azimuth, elevation and roll, radians, as `Camera`'s; the reciprocal of the distance to
    the middle of the unit frame; the logarithm of how long a unit length there is in the picture, whose
    sides are 1; where the middle is, to the right of the picture's own and above it. up: as `Camera`'s."""

    numbers: np.ndarray
    up: str

    @classmethod
    def filling(cls, camera: Camera, vertices: np.ndarray, box: tuple[float, float, float, float]) -> Pinhole:
        """As a camera that sees vertices (V, 3), but that they fill a box of the picture: its left, bottom,
        right and top, from its middle."""
        view = camera.fitted(vertices, _CELLS, _CELLS)
        near = np.clip(1 / max(float(view.eye @ view.back), 1.0), _FARTHEST, _NEAREST)
        turned = (math.radians(camera.azimuth), math.radians(camera.elevation), 0.0)
        plain = np.array([*turned, near, 0.0, 0.0, 0.0])
        places = cls(plain, camera.up).project(vertices)
        low, high = places.min(axis=0), places.max(axis=0)
        given = np.array(box).reshape(2, 2)
        size = math.sqrt(np.prod(given[1] - given[0]) / max(np.prod(high - low), 1e-12))
        middle = (given.sum(axis=0) - size * (low + high)) / 2
        return cls(np.array([*plain[:4], math.log(size), *middle]), camera.up)

    def moved(self, steps: np.ndarray) -> Pinhole:
        """With steps (7,) added to its numbers, as far as it may come near or go away."""
        numbers = self.numbers + steps
        numbers[NEAR] = np.clip(numbers[NEAR], _FARTHEST, _NEAREST)
        return replace(self, numbers=numbers)

    @property
    def near(self) -> float:
        """The reciprocal of its distance."""
        return float(self.numbers[NEAR])

    @property
    def size(self) -> float:
        """How long a unit length in the middle is in the picture."""
        return math.exp(self.numbers[4])

    @property
    def camera(self) -> Camera:
        """That sees the same side, from as near; what is seen fills its picture."""
        field = 2 * math.degrees(math.atan(self.near / (2 * self.size)))
        azimuth, elevation = np.degrees(self.numbers[:2]).tolist()
        return Camera(azimuth, elevation, float(np.clip(field, _LEAST, _WIDEST)), self.up, 0.0)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The picture's right and up, and towards the viewer, (3,) each."""
        side, above, front = picture_axes(self.up)
        azimuth, elevation, roll = self.numbers[:3]
        level = math.cos(azimuth) * front + math.sin(azimuth) * side
        back = math.cos(elevation) * level + math.sin(elevation) * above
        right = -math.sin(azimuth) * front + math.cos(azimuth) * side
        upward = np.cross(back, right)
        c, s = math.cos(roll), math.sin(roll)
        return c * right + s * upward, c * upward - s * right, back

    def project(self, points: np.ndarray) -> np.ndarray:
        """(N, 2) places in the picture, to the right of its middle and above it, of points (N, 3)."""
        right, up, back = self.axes
        scale = self.size / (1 - self.near * (points @ back))
        return np.stack([points @ right * scale, points @ up * scale], axis=1) + self.numbers[5:]

    def by_points(self, points: np.ndarray) -> np.ndarray:
        """(N, 2, 3): how places change with points (N, 3)."""
        right, up, back = self.axes
        deep = 1 / (1 - self.near * (points @ back))
        along = [
            self.size * (deep[:, None] * axis + (self.near * deep**2 * (points @ axis))[:, None] * back)
            for axis in (right, up)
        ]
        return np.stack(along, axis=1)

    def by_numbers(self, points: np.ndarray) -> np.ndarray:
        """(N, 2, 7): how places of points (N, 3) change with the camera's numbers, by central differences."""

        def placed(step: np.ndarray) -> np.ndarray:
            return replace(self, numbers=self.numbers + step).project(points)

        steps = _STEP * np.eye(NUMBERS)
        return np.stack([(placed(s) - placed(-s)) / (2 * _STEP) for s in steps], axis=-1)

    def rays(self, cells: int) -> tuple[np.ndarray, np.ndarray]:
        """The eye (3,), and unit directions (cells * cells, 3) through the pixels, by rows from the top."""
        right, up, back = self.axes
        place = (np.arange(cells) + 0.5) / cells - 0.5
        across = np.tile((place - self.numbers[5]) / self.size, cells)
        above = np.repeat((-place - self.numbers[6]) / self.size, cells)
        eye = back / self.near
        ways = across[:, None] * right + above[:, None] * up - eye
        return eye, (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
