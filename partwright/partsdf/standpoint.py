"""Where a picture of a shape was taken from, and how well the shape's outline then covers what is seen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from partwright.render import Camera
from partwright.render.raycast import Scene

_CELLS = 64  # along the longer side of a silhouette
_FIELDS = (12.0, 25.0, 45.0)  # degrees
_STEPS = (16.0, 8.0, 4.0)  # degrees, of azimuth and elevation
_FAR = 20.0  # degrees from where it was seen, of either
_WAYS = ((-1, 0), (1, 0), (0, -1), (0, 1))
_SWEEPS = 8  # at most, while they help
_LOWEST, _HIGHEST = -30.0, 80.0


@dataclass(frozen=True)
class Standpoint:
    """camera: whose picture of the shape is most like the silhouette that was seen; iou: of both, each
    brought to its own bounding box."""

    camera: Camera
    iou: float


def find_standpoint(
    vertices: np.ndarray,
    faces: np.ndarray,
    silhouette: np.ndarray,
    azimuth: float,
    elevation: float,
    up: str,
) -> Standpoint:
    """The best near an azimuth and an elevation, in degrees: a silhouette that was badly seen is not to lead
    far away from these.

    vertices (V, 3), faces (F, 3), as the family stands, with the axis `up`. silhouette (H, W) bool, True
    somewhere.
    """
    scene, wanted = Scene(vertices, faces), boxed(silhouette)

    def judged(camera: Camera) -> Standpoint:
        found = outline(scene, camera)
        return Standpoint(camera, float((found & wanted).sum() / max((found | wanted).sum(), 1)))

    first = Camera(azimuth, float(np.clip(elevation, _LOWEST, _HIGHEST)), _FIELDS[1], up, 0.0)
    best = judged(first)
    for step in _STEPS:
        for _ in range(_SWEEPS):
            before = best
            for aside, above in _WAYS:
                camera = best.camera
                side = camera.azimuth + step * aside
                height = float(np.clip(camera.elevation + step * above, _LOWEST, _HIGHEST))
                if abs(side - first.azimuth) > _FAR or abs(height - first.elevation) > _FAR:
                    continue
                turned = replace(camera, azimuth=side, elevation=height)
                best = max(best, judged(turned), key=lambda s: s.iou)
            for field in _FIELDS:
                best = max(best, judged(replace(best.camera, field_of_view=field)), key=lambda s: s.iou)
            if best is before:
                break
    return best


def outline(scene: Scene, camera: Camera, cells: int = _CELLS) -> np.ndarray:
    """(cells, cells) bool: what a camera sees of a scene, within its margin."""
    view = camera.fitted(scene.vertices, cells, cells)
    rays = view.rays(cells, cells)
    face, _, _ = scene.first_hit(np.broadcast_to(view.eye, rays.shape), rays)
    return (face >= 0).reshape(cells, cells)


def extent(mask: np.ndarray) -> tuple[int, int, int, int]:
    """Top, left, bottom and right of the pixels that are marked in a mask (H, W), which has some; the latter
    two are the first beyond."""
    rows, columns = (np.flatnonzero(mask.any(axis=a)) for a in (1, 0))
    return int(rows[0]), int(columns[0]), int(rows[-1]) + 1, int(columns[-1]) + 1


def boxed(silhouette: np.ndarray) -> np.ndarray:
    """(64, 64) bool: a silhouette (H, W) cut out to its bounding box, in the middle of a square."""
    top, left, bottom, right = extent(silhouette)
    middle = np.array([top + bottom, left + right]) / 2
    side = max(bottom - top, right - left)
    place = ((np.arange(_CELLS) + 0.5) / _CELLS - 0.5) * side
    down, across = (np.floor(m + place).astype(int) for m in middle)
    inside = (
        ((down >= 0) & (down < silhouette.shape[0]))[:, None]
        & ((across >= 0) & (across < silhouette.shape[1]))[None]
    )  # fmt: skip
    near = [np.clip(a, 0, n - 1) for a, n in zip((down, across), silhouette.shape, strict=True)]
    return silhouette[near[0][:, None], near[1]] & inside
