"""Before and after, side by side, and the way between them as a GIF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from partwright.assembly.palette import palette
from partwright.goals.flow.simulation import PRESSURE
from partwright.goals.flow.skin import Skin
from partwright.goals.objectives.axes import axis
from partwright.goals.objectives.newtonian import pressure
from partwright.goals.problem import Point
from partwright.goals.surface import face_labels
from partwright.render import Camera, sheet, write_png
from partwright.render.camera import View
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import look

_PANEL, _FRAME = (460, 400), (360, 320)
_FRAMES = 16
_CALM, _HIGH = np.array((66, 104, 180)), np.array((196, 52, 44))  # pressure coefficient 0 and 2
_SUCTION, _NONE = np.array((66, 104, 180)), np.array((238, 238, 236))  # -1 and 0 of a simulation; 1 is high


def before_and_after(
    points: Sequence[Point], objective: str, path: Path, skins: Sequence[Skin] = (), metres: float = 1.0
) -> None:
    """PNG of the first and the last point, in a colour a part; for drag also the pressure on them.

    skins: what a simulation of both leaves on them, where there was one. metres: length of the points' unit.
    """
    ends = [points[0], points[-1]]
    camera, view = _camera(ends, _PANEL)
    images = [_drawn(point, camera, view, _PANEL, _part_colours(point)) for point in ends]
    captions = ["before", "after"]
    name, _, flow = objective.partition("@")
    if name == "newtonian_drag":
        images += [_drawn(p, camera, view, _PANEL, _pressure_colours(p, axis(flow, "x", name))) for p in ends]
        captions += ["Newtonian pressure, before", "Newtonian pressure, after"]
    for point, skin, caption in zip(ends, skins, captions, strict=False):
        images.append(_drawn(point, camera, view, _PANEL, _skin_colours(point, skin, metres)))
        captions = [*captions, f"simulated pressure, {caption}"]
    write_png(path, sheet(images, captions, columns=2))


def trajectory(points: Sequence[Point], path: Path) -> None:
    """GIF of the points, at most 16 of them, from one place."""
    from PIL import Image

    chosen = np.unique(np.linspace(0, len(points) - 1, min(_FRAMES, len(points))).round().astype(int))
    some = [points[i] for i in chosen]
    camera, view = _camera(some, _FRAME)
    images = [_drawn(point, camera, view, _FRAME, _part_colours(point)) for point in some]
    frames = [Image.fromarray(image).quantize(128, dither=Image.Dither.NONE) for image in images]
    first, rest = frames[0], frames[1:]
    times = [150] * (len(frames) - 1) + [1200]
    write(
        path,
        lambda name: first.save(
            name, format="GIF", save_all=True, append_images=rest, duration=times, loop=0
        ),
    )


def _camera(points: Sequence[Point], size: tuple[int, int]) -> tuple[Camera, View]:
    """One that sees all of them."""
    camera = Camera(up=points[0].assembly.up or "z", margin=0.08)
    return camera, camera.fitted(np.concatenate([point.surface.vertices for point in points]), *size)


def _drawn(
    point: Point, camera: Camera, view: View, size: tuple[int, int], colours: np.ndarray
) -> np.ndarray:
    scene = Scene(point.surface.vertices, point.surface.faces)
    different, number = np.unique(colours, axis=0, return_inverse=True)
    buffer = look(scene, camera, view, *size, label=lambda hits: number.reshape(-1)[hits.face])
    return buffer.image(different[buffer.labels])


def _part_colours(point: Point) -> np.ndarray:
    labels = face_labels(point.assembly, point.surface)
    return np.asarray(palette(len(point.assembly))[labels])


def _pressure_colours(point: Point, flow: np.ndarray) -> np.ndarray:
    share = pressure(np.array(point.surface.vertices), np.array(point.surface.faces), flow) / 2
    share = np.round(16 * share)[:, None] / 16
    return np.round(_CALM + share * (_HIGH - _CALM)).astype(np.uint8)


def _skin_colours(point: Point, skin: Skin, metres: float) -> np.ndarray:
    share = np.clip(skin.at(PRESSURE, metres * point.surface.triangles_center), -1, 1)
    share = np.round(12 * share)[:, None] / 12
    return np.round(_NONE + np.abs(share) * (np.where(share > 0, _HIGH, _SUCTION) - _NONE)).astype(np.uint8)
