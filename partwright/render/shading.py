"""Light: a soft key light with shadows, a hemispheric sky with occlusion, and a shadow on the ground."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from partwright.render.antialiasing import RAYS, edge_pixels, rays_within
from partwright.render.camera import Camera, View
from partwright.render.raycast import Hits, Scene, cast

BACKGROUND = (250, 250, 251)
NEUTRAL = (196, 200, 208)
_SKY, _GROUND, _KEY = np.array([0.62, 0.64, 0.68]), np.array([0.34, 0.32, 0.30]), np.array([0.86, 0.83, 0.78])
_SKY_RAYS = 4  # per hit
_SMOOTHING, _SOFTENING = 5, 3  # pixels along a side, of the sky's light and of shadows
_GROUND_CELLS, _GROUND_RAYS, _GROUND_REACH = 64, 24, 1.1
_SHADOW = 0.55  # how dark the ground gets where it sees no sky


@dataclass(frozen=True)
class Buffer:
    """A view of a mesh, ready to be coloured as often as one likes.

    hits: what is seen, `hits.pixel` where; share: (N,) of its pixel that each fills; labels: (N,) as `look`
    was told to set them; light: (N, 3) linear light that arrives there; ground: (H * W,) the share of light
    on the background.
    """

    width: int
    height: int
    hits: Hits
    share: np.ndarray
    labels: np.ndarray
    light: np.ndarray
    ground: np.ndarray

    def image(self, colours: np.ndarray) -> np.ndarray:
        """(height, width, 3) uint8 picture with these sRGB colours (3,) or (N, 3), 0..255, at the hits."""
        pixels = self.width * self.height
        seen = _to_linear(np.asarray(colours)) * self.light * self.share[:, None]
        free = 1 - np.bincount(self.hits.pixel, self.share, pixels)
        below = _to_linear(np.array(BACKGROUND))
        linear = np.empty((pixels, 3), dtype=np.float32)
        for i in range(3):
            linear[:, i] = np.bincount(self.hits.pixel, seen[:, i], pixels) + free * self.ground * below[i]
        return _to_srgb(linear).reshape(self.height, self.width, 3)


def look(
    scene: Scene,
    camera: Camera,
    view: View,
    width: int,
    height: int,
    ground: bool = True,
    label: Callable[[Hits], np.ndarray] | None = None,
) -> Buffer:
    """Cast the view's rays, one a pixel and more where it lies on an edge, and light what they meet.

    label: whole numbers (N,) for hits; where they change, as between colours, there is an edge too.
    """
    label = label or (lambda hits: np.zeros(len(hits.pixel), np.int64))
    rays = view.rays(width, height)
    hits = cast(scene, view, rays)
    labels = label(hits)
    edge = edge_pixels(hits, labels, width, height)
    whole = ~np.isin(hits.pixel, edge)
    directions, pixel = rays_within(view, edge, width, height)
    fine = cast(scene, view, directions).moved_to(pixel)
    share = np.concatenate([np.ones(whole.sum()), np.full(len(fine.pixel), 1 / RAYS**2)])
    hits, labels = hits.at(whole).and_also(fine), np.concatenate([labels[whole], label(fine)])
    below = _ground_light(scene, view.eye, rays, camera.up_axis) if ground else np.ones(len(rays))
    light = _light(scene, camera.up_axis, view, hits, share, (height, width))
    return Buffer(width, height, hits, share, labels, light.astype(np.float32), below)


def _light(
    scene: Scene, up: np.ndarray, view: View, hits: Hits, share: np.ndarray, picture: tuple[int, int]
) -> np.ndarray:
    """(N, 3) linear light that arrives at hits which fill these shares of their pixels."""
    start = hits.round + 1e-4 * scene.size * hits.normal
    noise = _noise(hits.pixel, picture[1])
    key = -0.45 * view.right + 0.75 * view.up + 0.62 * view.back
    key = key / np.linalg.norm(key)
    toward = np.clip(hits.normal @ key, 0.0, None)
    lit = toward > 0
    shade = np.zeros(len(lit))
    free = ~scene.occluded(start[lit], _jittered(key, noise[lit]))
    shade[lit] = 0.15 + 0.85 * _smoothed(free, hits.pixel[lit], share[lit], picture, _SOFTENING)
    openness = _smoothed(_openness(scene, start, hits.normal, noise), hits.pixel, share, picture, _SMOOTHING)
    height_share = (0.5 + 0.5 * (hits.normal @ up))[:, None]
    sky = _SKY * height_share + _GROUND * (1 - height_share)
    return sky * (0.25 + 0.75 * openness[:, None]) + _KEY * (toward * shade)[:, None]


def _noise(pixel: np.ndarray, width: int) -> np.ndarray:
    """A number in [0, 1) a pixel, far from its neighbours' (interleaved gradient noise, Jimenez 2014)."""
    y, x = np.divmod(pixel, width)
    return np.modf(52.9829189 * np.modf(0.06711056 * x + 0.00583715 * y)[0])[0]


def _jittered(direction: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """The directions (N, 3) to places of a light of about five degrees."""
    turn = 2 * np.pi * noise
    side = np.cross(direction, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    other = np.cross(direction, side)
    return direction + 0.06 * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)


def _openness(scene: Scene, start: np.ndarray, normal: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """(N,) cosine-weighted share of the hemisphere from which light arrives."""
    open_rays = np.zeros(len(noise))
    for i in range(_SKY_RAYS):
        # A point of the unit sphere added to the normal is cosine-distributed around it.
        z = 2 * np.modf(noise + (i + 0.5) / _SKY_RAYS)[0] - 1
        turn = 2 * np.pi * np.modf(noise * 7.0 + i * 0.618034)[0]
        flat = np.sqrt(np.maximum(1 - z * z, 0))
        sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
        open_rays += ~scene.occluded(start, normal + 0.999 * sphere)
    return open_rays / _SKY_RAYS


def _smoothed(
    values: np.ndarray, pixel: np.ndarray, share: np.ndarray, picture: tuple[int, int], size: int
) -> np.ndarray:
    """Mean (N,) over the hits of a small neighbourhood, which hides the noise of few rays."""
    from scipy.ndimage import uniform_filter

    pixels = picture[0] * picture[1]
    total, weight = (
        uniform_filter(np.bincount(pixel, each, pixels).reshape(picture), size).ravel()[pixel]
        for each in (values * share, share)
    )
    return total / np.maximum(weight, 1e-6)


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


def _linear(share: np.ndarray) -> np.ndarray:
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def _encoded(share: np.ndarray) -> np.ndarray:
    return np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)


# Powers of millions of numbers take longer than to look them up.
_LINEAR = _linear(np.arange(256) / 255).astype(np.float32)
_SRGB = np.round(255 * _encoded(np.linspace(0, 1, 1 << 14))).astype(np.uint8)


def _to_linear(colours: np.ndarray) -> np.ndarray:
    return np.asarray(_LINEAR[np.rint(colours).astype(np.uint8)])


def _to_srgb(linear: np.ndarray) -> np.ndarray:
    return np.asarray(_SRGB[np.rint(np.clip(linear, 0, 1) * (len(_SRGB) - 1)).astype(np.int64)])
