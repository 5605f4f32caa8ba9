"""A fit's curve at a glance: the same shape from few parts to many."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.palette import palette
from partwright.meshing import mesh_assembly
from partwright.render.camera import Camera
from partwright.render.output import write_png
from partwright.render.part_colours import hit_parts
from partwright.render.raycast import Scene
from partwright.render.shading import look
from partwright.render.sheet import sheet

if TYPE_CHECKING:
    from partwright.assembly import Assembly


def curve_sheet(
    assemblies: Sequence[Assembly],
    captions: Sequence[str],
    path: str | Path | None = None,
    *,
    title: str = "",
    camera: Camera | None = None,
    panel: tuple[int, int] = (320, 320),
) -> np.ndarray:
    """Assemblies side by side from one viewpoint, coloured by part, as one picture (H, W, 3) uint8.

    Written to `path` as PNG if one is given.
    """
    surfaces = [mesh_assembly(assembly, resolution=96) for assembly in assemblies]
    camera = camera or Camera(up=assemblies[0].up or "z", margin=0.1)
    scenes = [Scene(surface.vertices, surface.faces) for surface in surfaces]
    view = camera.fitted(np.concatenate([scene.vertices for scene in scenes]), *panel)
    images = []
    for assembly, scene in zip(assemblies, scenes, strict=True):
        seen = look(scene, camera, view, *panel, label=partial(hit_parts, assembly))
        images.append(seen.image(palette(len(assembly))[seen.labels]))
    page = sheet(images, captions, title=title)
    if path is not None:
        write_png(path, page)
    return page
