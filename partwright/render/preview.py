"""The fit at a glance: input, parts, blended surface and error, side by side."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.metadata import GUESSED
from partwright.assembly.palette import palette
from partwright.meshing import mesh_assembly
from partwright.render.camera import Camera
from partwright.render.deviation_map import add_legend, deviation_colours, round_limit
from partwright.render.output import write_png
from partwright.render.part_colours import hit_parts
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look
from partwright.render.sheet import sheet

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly
    from partwright.shapes import Shape

CAPTIONS = ("input", "parts", "surface", "error")
GUESSES = "parts (pale: guessed)"
_PALE, _OF_COLOUR = 238, 0.3  # what guessed parts are painted with, and what is left of their colour
_GRAINS, _GRAIN = 10_000, 0.005  # points that are drawn, about, and their half-width in longest sides
_SIDE, _LEAST_SIDE = 400, 310  # pixels of a panel: as a square, and the least; the legend wants some


def preview(
    shape: Shape,
    assembly: Assembly,
    surface: trimesh.Trimesh | None = None,
    path: str | Path | None = None,
    *,
    title: str = "",
    camera: Camera | None = None,
    panel: tuple[int, int] | None = None,
) -> np.ndarray:
    """Draw input | parts | surface | error as one picture (H, W, 3) uint8, and write it as PNG to `path`.

    The input of a shape that came as points is these points. The parts' panel colours every point by the part
    whose own surface is there; parts that the input does not show (`GUESSED` in their metadata) are pale. The
    error panel colours the input by the assembly's signed distance there: red where the assembly covers the
    input's surface, blue where it does not reach it, with a legend in the input's unit.

    surface: the assembly's mesh in the input's units, if it is known already. panel: width and height of each
    of the four in pixels; as the object is long and high if None.
    """
    surface = mesh_assembly(assembly) if surface is None else surface
    camera = camera or Camera(up=shape.up or "z", margin=0.1)
    given, made = Scene(*_as_given(shape)), Scene(surface.vertices, surface.faces)
    both = np.concatenate([given.vertices, made.vertices])
    width, height = panel or camera.framed(both, _SIDE, _LEAST_SIDE)
    view = camera.fitted(both, width, height)
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(look, given, camera, view, width, height)
        second = pool.submit(look, made, camera, view, width, height, label=partial(hit_parts, assembly))
        input_view, result_view = first.result(), second.result()

    deviation = -assembly.distance(input_view.hits.point)
    limit = round_limit(deviation)
    error = input_view.image(deviation_colours(deviation, limit))
    page = sheet(
        [
            input_view.image(np.array(NEUTRAL)),
            result_view.image(_colours(assembly)[result_view.labels]),
            result_view.image(np.array(NEUTRAL)),
            add_legend(error, limit, shape.unit, float(np.abs(deviation).max(initial=0.0))),
        ],
        [GUESSES if name == "parts" and _guessed(assembly).any() else name for name in CAPTIONS],
        title=title,
    )
    if path is not None:
        write_png(path, page)
    return page


def _guessed(assembly: Assembly) -> np.ndarray:
    """(N,) of the leaves."""
    return np.array([GUESSED in part.metadata for part in assembly.parts], dtype=bool)


def _colours(assembly: Assembly) -> np.ndarray:
    """(N, 3) uint8 of the leaves."""
    colours = palette(len(assembly))
    pale = np.rint(_OF_COLOUR * colours + (1 - _OF_COLOUR) * _PALE).astype(np.uint8)
    return np.where(_guessed(assembly)[:, None], pale, colours)


def _as_given(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of the input's panel: of a shape that came as points a grain for each of them, not
    the surface laid through them, which hides holes and noise."""
    if shape.points is None:
        return shape.vertices, shape.faces
    points = shape.points[:: max(1, len(shape.points) // _GRAINS)]
    size = _GRAIN * min(2, (_GRAINS / len(points)) ** 0.25) * float(np.ptp(points, axis=0).max())
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    sides = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    faces = sides + len(corners) * np.arange(len(points))[:, None, None]
    return (points[:, None] + size * corners).reshape(-1, 3), faces.reshape(-1, 3)
