"""One mesh, one picture; and a turn around it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import EmptyShapeError
from partwright.render.camera import Camera
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look

if TYPE_CHECKING:
    import trimesh


def render_mesh(
    mesh: trimesh.Trimesh,
    camera: Camera | None = None,
    size: tuple[int, int] = (480, 480),
    colours: np.ndarray | tuple[int, int, int] = NEUTRAL,
    ground: bool = True,
) -> np.ndarray:
    """A picture (height, width, 3) uint8 of a mesh on white, anti-aliased, fitted into the frame.

    size: width and height in pixels. colours: one sRGB colour (3,) or one a face (F, 3), 0..255.

    Raises EmptyShapeError for a mesh without faces.
    """
    if len(mesh.faces) == 0:
        raise EmptyShapeError("There is nothing to draw: the mesh has no faces.")
    camera = camera or Camera()
    scene = Scene(mesh.vertices, mesh.faces)
    width, height = size
    view, palette, number = camera.fitted(scene.vertices, width, height), *_palette(colours, len(scene.faces))
    buffer = look(scene, camera, view, width, height, ground, label=lambda hits: number[hits.face])
    return buffer.image(palette[buffer.labels])


def turntable(
    mesh: trimesh.Trimesh,
    path: str | Path,
    camera: Camera | None = None,
    size: tuple[int, int] = (320, 320),
    colours: np.ndarray | tuple[int, int, int] = NEUTRAL,
    frames: int = 36,
    seconds: float = 4.0,
) -> None:
    """Write a GIF of one turn around the mesh's up axis. The distance stays the same all the way round."""
    from dataclasses import replace

    from PIL import Image

    camera = camera or Camera()
    scene = Scene(mesh.vertices, mesh.faces)
    width, height = size
    palette, number = _palette(colours, len(scene.faces))
    swept = _swept(scene, camera)
    pictures = []
    for frame in range(frames):
        turned = replace(camera, azimuth=camera.azimuth + 360.0 * frame / frames)
        view = turned.fitted(swept, width, height)
        buffer = look(scene, turned, view, width, height, label=lambda hits: number[hits.face])
        pictures.append(Image.fromarray(buffer.image(palette[buffer.labels])))
    first, *rest = [picture.quantize(128, dither=Image.Dither.NONE) for picture in pictures]
    write(
        path,
        lambda name: first.save(
            name, format="GIF", save_all=True, append_images=rest, duration=1000 * seconds / frames, loop=0
        ),
    )


def _palette(colours: np.ndarray | tuple[int, int, int], faces: int) -> tuple[np.ndarray, np.ndarray]:
    """Different colours (P, 3) of the faces, and which (F,) of them each has."""
    each = np.broadcast_to(np.asarray(colours), (faces, 3))
    palette, number = np.unique(each, axis=0, return_inverse=True)
    return palette, number.reshape(-1)


def _swept(scene: Scene, camera: Camera) -> np.ndarray:
    """The cylinder that the bounding box sweeps around the up axis, as points."""
    axis = "xyz".index(camera.up[-1])
    u, v = (axis + 1) % 3, (axis + 2) % 3
    middle = (scene.lower + scene.upper) / 2
    radius = np.linalg.norm((scene.vertices - middle)[:, [u, v]], axis=1).max()
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    rings = np.zeros((2, 64, 3))
    rings[0, :, axis], rings[1, :, axis] = scene.lower[axis], scene.upper[axis]
    rings[..., u] = middle[u] + radius * np.cos(turn)
    rings[..., v] = middle[v] + radius * np.sin(turn)
    return rings.reshape(-1, 3)
