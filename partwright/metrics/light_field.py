"""How alike two surfaces look: the light field distance of Chen, Tian, Shen and Ouhyoung (2003).

Our own implementation, comparable only within this project.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from partwright.render.raycast import Scene

if TYPE_CHECKING:
    import trimesh

SIZE = 128  # pixels along a silhouette
ZERNIKE_ORDER = 10  # 35 moments
FOURIER_TERMS = 10
_ANGLES = 128
_GOLDEN = (1 + math.sqrt(5)) / 2


def light_field_distance(first: trimesh.Trimesh, second: trimesh.Trimesh) -> float:
    """`light_field_distance`: the least sum of differences between ten silhouettes of each surface, seen
    along the axes through a dodecahedron's opposite vertices, over the 60 ways to turn one onto the other.

    A silhouette is told by 35 Zernike moments of its area and 10 Fourier coefficients of its outline, all in
    steps of 1/255 from 0 to 255; differences are absolute. Place and size do not count.
    """
    one, other = descriptors(first), descriptors(second)
    apart = np.abs(one[:, None] - other[None]).sum(axis=2)
    return float(min(apart[np.arange(len(turn)), turn].sum() for turn in _turns()))


def descriptors(mesh: trimesh.Trimesh) -> np.ndarray:
    """(10, 45) of the silhouettes of a mesh: Zernike moments, then Fourier coefficients, 0..255."""
    scene = Scene(mesh.vertices, mesh.faces)
    centre = (scene.lower + scene.upper) / 2
    radius = float(np.linalg.norm(scene.vertices - centre, axis=1).max())
    values = np.stack([_descriptor(_silhouette(scene, centre, radius, axis)) for axis in _axes()])
    return np.round(255 * np.clip(values, 0, 1))


def _silhouette(scene: Scene, centre: np.ndarray, radius: float, axis: np.ndarray) -> np.ndarray:
    """(P, 2) middles of the covered pixels of an orthographic view along a unit axis, in radii."""
    least = np.eye(3)[int(np.abs(axis).argmin())]
    right = np.cross(axis, least)
    right /= np.linalg.norm(right)
    up = np.cross(right, axis)
    ticks = (np.arange(SIZE) + 0.5) * (2 / SIZE) - 1
    places = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    start = centre + radius * (places @ np.stack([right, up]) - 2 * axis)
    seen = scene.occluded(start, np.broadcast_to(axis, start.shape))
    return places[seen]


def _descriptor(pixels: np.ndarray) -> np.ndarray:
    """(45,) of covered pixels (P, 2), about their centroid and in units of the farthest; 0 where none is."""
    if not len(pixels):
        return np.zeros(sum(n // 2 + 1 for n in range(1, ZERNIKE_ORDER + 1)) + FOURIER_TERMS)
    place = pixels - pixels.mean(axis=0)
    distance = np.linalg.norm(place, axis=1)
    distance = distance / max(float(distance.max()), 1 / SIZE)
    angle = np.arctan2(place[:, 1], place[:, 0])
    return np.concatenate([_zernike(distance, angle), _fourier(distance, angle)])


def _zernike(distance: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """|mean of V_nm| over the silhouette for n = 1..10 and m = n, n - 2 ... >= 0, each in 0..1."""
    powers = distance[None] ** np.arange(ZERNIKE_ORDER + 1)[:, None]
    turns = np.exp(-1j * angle * np.arange(ZERNIKE_ORDER + 1)[:, None])
    # moment[k, m]: mean of distance^k e^(-i m angle); the radial polynomials only combine them.
    moment = powers @ turns.T / len(distance)
    return np.array(
        [
            abs(sum(weight * moment[n - 2 * s, m] for s, weight in enumerate(_radial(n, m))))
            for n in range(1, ZERNIKE_ORDER + 1)
            for m in range(n % 2, n + 1, 2)
        ]
    )


def _radial(n: int, m: int) -> list[float]:
    """Coefficients of distance^(n - 2 s), s = 0, 1 ..., of Zernike's radial polynomial."""
    f = math.factorial
    return [
        (-1) ** s * f(n - s) / (f(s) * f((n + m) // 2 - s) * f((n - m) // 2 - s))
        for s in range((n - m) // 2 + 1)
    ]


def _fourier(distance: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """|F_k| / |F_0|, k = 1..10, of the outline: the farthest covered place in each direction."""
    outline = np.zeros(_ANGLES)
    np.maximum.at(outline, ((angle / (2 * np.pi)) % 1.0 * _ANGLES).astype(int) % _ANGLES, distance)
    spectrum = np.abs(np.fft.rfft(outline))
    return np.asarray(spectrum[1 : FOURIER_TERMS + 1] / max(float(spectrum[0]), 1e-12))


@lru_cache(maxsize=1)
def _axes() -> np.ndarray:
    """(10, 3) unit axes through opposite vertices of a dodecahedron."""
    g, h = _GOLDEN, 1 / _GOLDEN
    cube = [(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]
    rest = [(0, h, g), (0, h, -g), (h, g, 0), (h, -g, 0), (g, 0, h), (-g, 0, h)]
    return np.array(cube + rest, dtype=np.float64) / math.sqrt(3)


@lru_cache(maxsize=1)
def _turns() -> tuple[np.ndarray, ...]:
    """The 60 rotations of the dodecahedron as orders (10,) of its axes."""
    third = np.eye(3)[[2, 0, 1]]
    fifth = _rotation(np.array([0.0, _GOLDEN, 1.0]), 2 * math.pi / 5)
    group = [np.eye(3)]
    for known in group:  # grows until it is closed
        for made in (third @ known, fifth @ known):
            if not any(np.allclose(made, other) for other in group):
                group.append(made)
    axes = _axes()
    return tuple(np.abs(axes @ rotation @ axes.T).argmax(axis=1) for rotation in group)


def _rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)
