"""Neural shapes as pictures: stills coloured by part, and films from one shape to another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from partwright.assembly.palette import palette
from partwright.datasets.prepared import PreparedShape
from partwright.errors import SettingError, UnsupportedFormatError
from partwright.partsdf.editing import interpolated
from partwright.partsdf.meshing import ShareDone, mesh_parts, resolution_for_wall
from partwright.partsdf.neural import NeuralShape
from partwright.render import Camera, render_mesh, sheet, write_png
from partwright.render.output import write

if TYPE_CHECKING:
    import trimesh

_COARSE, _FINE, _FILM = 64, 192, 160  # cells along the unit frame of a picture, by its thinnest wall
_MAX_SHEET_PICTURES = 8  # pictures of a contact sheet
_FRAME_MILLISECONDS = 60  # milliseconds
_PAUSE_FRAMES = 8  # frames' time at either end


def picture(
    shape: NeuralShape,
    resolution: int | None = None,
    size: int = 320,
    camera: Camera | None = None,
    progress: ShareDone | None = None,
) -> np.ndarray:
    """(size, size, 3) uint8, each part in its colour; blank where the shape has no surface.

    resolution: cells along the unit frame, a multiple of 8; if not given, 64 to 192 by the thinnest wall.
    """
    import trimesh

    parts = mesh_parts(shape, resolution or picture_resolution(shape), progress)
    if not parts:
        return blank(size)
    colours = palette(len(shape.model.parts))
    faces = [np.tile(colours[shape.model.index(n)], (len(m.faces), 1)) for n, m in parts.items()]
    mesh = cast("trimesh.Trimesh", trimesh.util.concatenate(list(parts.values())))
    return render_mesh(mesh, camera, (size, size), np.concatenate(faces))


def target_picture(shape: PreparedShape, size: int, camera: Camera | None = None) -> np.ndarray:
    """(size, size, 3) uint8 of a prepared shape, each part in its colour; blank where it was prepared without
    its surface."""
    import trimesh

    if not len(shape.faces):
        return blank(size)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    return render_mesh(mesh, camera, (size, size), palette(len(shape.present))[shape.label])


def picture_resolution(*shapes: NeuralShape, most: int = _FINE) -> int:
    """Cells along the unit frame that show the shapes' thinnest wall, at most as many as the cost allows."""
    thinnest = min(shape.thinnest for shape in shapes)
    return min(most, resolution_for_wall(thinnest, _COARSE))


def blank(size: int) -> np.ndarray:
    return np.full((size, size, 3), 255, dtype=np.uint8)


def check_film(path: str | Path, steps: int) -> None:
    """Raise what `film` would, before there is any work."""
    if Path(path).suffix.lower() != ".gif":
        raise UnsupportedFormatError(f"{path}: films are written as .gif")
    if steps < 2:
        raise SettingError(f"steps is {steps}; expected 2 or more")


def film(
    a: NeuralShape,
    b: NeuralShape,
    path: str | Path,
    steps: int = 24,
    resolution: int | None = None,
    size: int = 320,
    camera: Camera | None = None,
    progress: ShareDone | None = None,
) -> Path:
    """Write a GIF from a to b and back, and a contact sheet beside it (same name, .png); returns the sheet.

    progress: told the share that is done.

    Raises:
        UnsupportedFormatError: the suffix is not .gif.
        SettingError: fewer than two steps.
    """
    from PIL import Image

    check_film(path, steps)
    resolution = resolution or picture_resolution(a, b, most=_FILM)
    frames = []
    for i in range(steps):

        def told(done: float, before: int = i) -> None:
            if progress:
                progress((before + done) / steps)

        shape = interpolated(a, b, i / (steps - 1))
        frames.append(picture(shape, resolution, size, _fixed(camera), told))
    first, *rest = [
        Image.fromarray(f).quantize(128, dither=Image.Dither.NONE) for f in [*frames, *frames[-2:0:-1]]
    ]
    times = [
        _FRAME_MILLISECONDS * (_PAUSE_FRAMES if i in (0, steps - 1) else 1) for i in range(len(rest) + 1)
    ]
    options = {"save_all": True, "append_images": rest, "duration": times, "loop": 0}
    write(path, lambda name: first.save(name, format="GIF", **options))
    chosen = np.unique(np.linspace(0, steps - 1, min(_MAX_SHEET_PICTURES, steps)).round().astype(int))
    captions = [f"{i / (steps - 1):.2f}" for i in chosen]
    still = Path(path).with_suffix(".png")
    write_png(still, sheet([frames[i] for i in chosen], captions, columns=min(4, len(chosen))))
    return still


def _fixed(camera: Camera | None) -> Camera:
    return replace(camera or Camera(), margin=0.12)
