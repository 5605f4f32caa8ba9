"""Light: a soft key light with shadows, a hemispheric sky with occlusion, and a shadow on the ground."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from partwright.render.camera import Camera, View
from partwright.render.raycast import Hits, Scene, cast

SUPERSAMPLING = 2
BACKGROUND = (250, 250, 251)
NEUTRAL = (196, 200, 208)
_SKY, _GROUND, _KEY = np.array([0.62, 0.64, 0.68]), np.array([0.34, 0.32, 0.30]), np.array([0.86, 0.83, 0.78])
_SKY_RAYS = 3  # per sample: with 2 x 2 samples 12 a pixel
_SMOOTHING = 5  # samples along a side
_GROUND_CELLS, _GROUND_RAYS, _GROUND_REACH = 72, 32, 1.1
_SHADOW = 0.55  # how dark the ground gets where it sees no sky


@dataclass(frozen=True)
class Buffer:
    """A view of a mesh, ready to be coloured as often as one likes.

    hits: what each sample sees; light: (N, 3) linear light that arrives there; ground: (H * W,) the share of
    light on the background.
    """

    width: int
    height: int
    hits: Hits
    light: np.ndarray
    ground: np.ndarray

    def image(self, colours: np.ndarray) -> np.ndarray:
        """(height, width, 3) uint8 picture with these sRGB colours (3,) or (N, 3), 0..255, at the hits."""
        k = SUPERSAMPLING
        linear = np.empty((self.width * k * self.height * k, 3), dtype=np.float32)
        linear[:] = _to_linear(np.array(BACKGROUND)) * self.ground[:, None]
        linear[self.hits.pixel] = _to_linear(np.asarray(colours)) * self.light
        samples = linear.reshape(self.height, k, self.width, k, 3)
        rows = np.add.reduce([samples[:, i] for i in range(k)])
        return _to_srgb(np.add.reduce([rows[:, :, j] for j in range(k)]) / k**2)


def look(scene: Scene, camera: Camera, view: View, width: int, height: int, ground: bool = True) -> Buffer:
    """Cast the view's rays and light what they meet."""
    k = SUPERSAMPLING
    rays = view.rays(width * k, height * k)
    hits = cast(scene, view, rays)
    up = camera.up_axis
    start = replace(hits, point=hits.round + 1e-4 * scene.size * hits.normal)
    key = -0.45 * view.right + 0.75 * view.up + 0.62 * view.back
    key = key / np.linalg.norm(key)
    toward = np.clip(hits.normal @ key, 0.0, None)
    lit = toward > 0
    shade = np.zeros(len(lit))
    shade[lit] = 1.0 - 0.85 * scene.occluded(start.point[lit], _jittered(key, hits.pixel[lit], width * k))
    openness = _smoothed(_openness(scene, start, width * k), hits.pixel, (height * k, width * k))
    height_share = (0.5 + 0.5 * (hits.normal @ up))[:, None]
    sky = _SKY * height_share + _GROUND * (1 - height_share)
    light = sky * (0.25 + 0.75 * openness[:, None]) + _KEY * (toward * shade)[:, None]
    below = _ground_light(scene, view.eye, rays, up) if ground else np.ones(len(rays))
    return Buffer(width, height, hits, light.astype(np.float32), below.astype(np.float32))


def _noise(pixel: np.ndarray, width: int) -> np.ndarray:
    """A number in [0, 1) a pixel, far from its neighbours' (interleaved gradient noise, Jimenez 2014)."""
    y, x = np.divmod(pixel, width)
    return np.modf(52.9829189 * np.modf(0.06711056 * x + 0.00583715 * y)[0])[0]


def _jittered(direction: np.ndarray, pixel: np.ndarray, width: int) -> np.ndarray:
    """The direction to a light of about five degrees."""
    turn = 2 * np.pi * _noise(pixel, width)
    side = np.cross(direction, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    other = np.cross(direction, side)
    return direction + 0.06 * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)


def _openness(scene: Scene, start: Hits, width: int) -> np.ndarray:
    """(N,) cosine-weighted share of the hemisphere from which light arrives."""
    offset = _noise(start.pixel, width)
    open_rays = np.zeros(len(offset))
    for i in range(_SKY_RAYS):
        # A point of the unit sphere added to the normal is cosine-distributed around it.
        z = 2 * np.modf(offset + (i + 0.5) / _SKY_RAYS)[0] - 1
        turn = 2 * np.pi * np.modf(offset * 7.0 + i * 0.618034)[0]
        flat = np.sqrt(np.maximum(1 - z * z, 0))
        sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
        open_rays += ~scene.occluded(start.point, start.normal + 0.999 * sphere)
    return open_rays / _SKY_RAYS


def _smoothed(values: np.ndarray, pixel: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Mean over the hits of a small neighbourhood, which hides the noise of few rays."""
    from scipy.ndimage import uniform_filter

    total, weight = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
    total.reshape(-1)[pixel], weight.reshape(-1)[pixel] = values, 1.0
    total, weight = uniform_filter(total, _SMOOTHING), uniform_filter(weight, _SMOOTHING)
    return total.reshape(-1)[pixel] / np.maximum(weight.reshape(-1)[pixel], 1e-6)


def _ground_light(scene: Scene, eye: np.ndarray, rays: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(N,) how much light reaches the ground under the mesh where rays (N, 3) meet it, 1 where they do not.

    The plane's own coarse grid is lit and looked up: its shadows are soft anyway.
    """
    from scipy.ndimage import gaussian_filter, map_coordinates

    axis = int(np.abs(up).argmax())
    level = scene.lower[axis] if up[axis] > 0 else scene.upper[axis]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    middle = (scene.lower + scene.upper) / 2
    reach = _GROUND_REACH * scene.size
    steps = (np.arange(_GROUND_CELLS) + 0.5) / _GROUND_CELLS * 2 - 1
    place = np.zeros((_GROUND_CELLS, _GROUND_CELLS, 3))
    place[..., axis] = level - up[axis] * 2e-3 * scene.size
    place[..., u] = middle[u] + reach * steps[:, None]
    place[..., v] = middle[v] + reach * steps[None, :]
    grid = _sky_seen(scene, place.reshape(-1, 3), up).reshape(_GROUND_CELLS, _GROUND_CELLS)
    grid = gaussian_filter(grid, 1.2, mode="nearest")
    edge = np.clip(1.6 * (1 - np.hypot(steps[:, None], steps[None, :])), 0, 1)
    grid = 1 - _SHADOW * edge * (1 - grid)

    slope = rays[:, axis] * up[axis]
    met = np.flatnonzero(slope < 0) if (eye[axis] - level) * up[axis] > 0 else np.empty(0, dtype=np.int64)
    distance = (level - eye[axis]) * up[axis] / slope[met]
    hit = eye[[u, v]] + distance[:, None] * rays[met][:, [u, v]]
    cell = ((hit - middle[[u, v]]) / reach + 1) / 2 * _GROUND_CELLS - 0.5
    result = np.ones(len(rays))
    result[met] = map_coordinates(grid, cell.T, order=1, mode="constant", cval=1.0)
    return result


def _sky_seen(scene: Scene, points: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(N,) cosine-weighted share of the sky that is seen from points on the ground."""
    i = np.arange(_GROUND_RAYS)
    z = 1 - 2 * (i + 0.5) / _GROUND_RAYS
    turn = i * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z * z)
    rays = up + 0.98 * np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    origins = np.repeat(points, _GROUND_RAYS, axis=0)
    hidden = scene.occluded(origins, np.tile(rays, (len(points), 1)))
    return 1 - hidden.reshape(-1, _GROUND_RAYS).mean(axis=1)


def _to_linear(colours: np.ndarray) -> np.ndarray:
    share = np.asarray(colours, dtype=np.float32) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _to_srgb(linear: np.ndarray) -> np.ndarray:
    share = np.clip(linear, 0, 1)
    encoded = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)
