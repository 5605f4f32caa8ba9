"""The gallery of the README: shapes that the project makes itself, each as input, parts and surface.

    python benchmarks/gallery.py
    python benchmarks/gallery.py --shapes FOLDER --names A,B -o docs/images/assets.png

Every shape is fitted with default settings and seed 0. The picture goes to docs/images/gallery.png. With
--shapes it is of the meshes of a folder, as benchmarks/fit.py finds them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from fit import find_shapes
from PIL import Image

import partwright as pw
from partwright.assembly.palette import palette
from partwright.datasets.demo import watering_can
from partwright.datasets.objects import OBJECTS
from partwright.render import Camera, sheet
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look
from partwright.render.sheet import SOFT_INK, draw_text

TARGET = Path(__file__).parents[1] / "docs" / "images" / "gallery.png"
SHAPES = {"watering_can": watering_can, **OBJECTS}
AZIMUTHS = {"watering_can": -24.0, "mug": 24.0}
PANEL = 300
COLUMNS = 2  # shapes side by side


def own_shapes() -> Iterator[tuple[str, pw.Shape]]:
    for name, make in SHAPES.items():
        yield name, pw.load_shape(make(), unit="cm", up="z")


def panels(name: str, shape: pw.Shape) -> list[np.ndarray]:
    """Input, parts and surface (PANEL, PANEL, 3) from one viewpoint, the middle one captioned."""
    result = pw.fit(shape)
    scores, assembly = result.scores, result.assembly
    print(f"{name}: {len(assembly)} parts, IoU {scores.iou:.3f}, {scores.bi_surface_iou:.3f}", flush=True)
    camera = Camera(azimuth=AZIMUTHS.get(name, 32.0), margin=0.1, up=shape.up or "z")
    given = Scene(shape.vertices, shape.faces)
    made = Scene(np.asarray(result.surface.vertices), np.asarray(result.surface.faces))
    view = camera.fitted(np.concatenate([given.vertices, made.vertices]), PANEL, PANEL)
    before, after = (look(scene, camera, view, PANEL, PANEL) for scene in (given, made))
    nearest = assembly.part_distances(after.hits.point).argmin(axis=0)
    grey = np.array(NEUTRAL)
    coloured = after.image(palette(len(assembly))[nearest])
    caption = f"{name.replace('_', ' ')}: {len(assembly)} parts, IoU {scores.iou:.3f}"
    coloured = draw_text(coloured, [(PANEL / 2, PANEL - 12, caption)], size=13, colour=SOFT_INK)
    return [before.image(grey), coloured, after.image(grey)]


def main() -> int:
    options = parser().parse_args()
    shapes = own_shapes()
    if options.shapes is not None:
        found = find_shapes(options.shapes, set(), {*filter(None, options.names.split(","))})
        shapes = ((entry.name, pw.load_shape(entry.path)) for entry in found)
    page = sheet([image for one in shapes for image in panels(*one)], columns=3 * COLUMNS)
    heads = [((i + 0.5) * PANEL, 14, text) for i, text in enumerate(("input", "parts", "surface") * COLUMNS)]
    picture = Image.fromarray(draw_text(page, heads, size=15, colour=SOFT_INK))
    write(options.output, lambda name: picture.save(name, format="PNG", optimize=True))
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    result.add_argument("--shapes", type=Path, metavar="FOLDER", help="meshes in place of the own shapes")
    result.add_argument("--names", default="", metavar="A,B", help="only these of the folder")
    result.add_argument("-o", "--output", type=Path, default=TARGET, metavar="PNG", help="where to write")
    return result


if __name__ == "__main__":
    sys.exit(main())
