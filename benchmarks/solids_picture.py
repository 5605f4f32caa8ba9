"""The pictures of docs/solids.md and docs/clean.md: a bearing bracket of our own, fitted and cleaned.

    python benchmarks/solids_picture.py

The bracket is meshed, fitted by SuperFrusta and by solids with default settings and seed 0, and solids
found by the search alone are cleaned: those of features are plain already. The listings of the pages come
from the same run: they are printed.
"""

from __future__ import annotations

import argparse
import math
import sys
import textwrap
from pathlib import Path

import numpy as np
from PIL import Image

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.palette import palette
from partwright.fields import Box, Cylinder, Tube
from partwright.meshing import mesh_assembly
from partwright.render import Camera, sheet
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look
from partwright.render.sheet import SOFT_INK, draw_text

IMAGES = Path(__file__).parents[1] / "docs" / "images"
PANEL = 440
LINE = 17  # pixels of a line of text
LETTERS = 72  # of a line
ALONG_Y = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)


def bracket() -> Assembly:
    """A plate with four holes and a slot, a bearing on a web, in mm."""
    plate = Part(Box((120, 70, 12)), (0, 0, 6), name="plate")
    web = Part(Box((16, 30, 28)), (0, 0, 26), name="web")
    bearing = Part(Tube(24, 9, 44), (0, 0, 58), ALONG_Y, name="bearing")
    corners = tuple(Similarity(translation=move) for move in ((-92, 0, 0), (-92, -44, 0), (0, -44, 0)))
    hole = Part(Cylinder(5, 30), (46, 22, 6), name="hole", instances=corners)
    slot = Part(Box((12, 34, 30)), (32, 0, 6), name="slot")
    body = Assembly((plate, web))
    return Assembly((Assembly((body, hole, slot), operation="difference"), bearing), unit="mm", up="z")


def coloured(assembly: Assembly, camera: Camera, vertices: np.ndarray) -> np.ndarray:
    """The assembly in its parts' colours; a cut lends its colour to the walls that it leaves."""
    mesh = mesh_assembly(assembly, 128)
    view = camera.fitted(vertices, PANEL, PANEL)
    seen = look(Scene(np.asarray(mesh.vertices), np.asarray(mesh.faces)), camera, view, PANEL, PANEL)
    nearest = np.abs(assembly.part_distances(seen.hits.point)).argmin(axis=0)
    return seen.image(palette(len(assembly))[nearest])


def written(lines: list[str], width: int) -> np.ndarray:
    """Lines of text on a white ground."""
    page = np.full((LINE * (len(lines) + 1), width, 3), 255, np.uint8)
    labels = [(width / 2, LINE * (i + 0.8), line) for i, line in enumerate(lines)]
    return draw_text(page, labels, size=12, colour=SOFT_INK)


def save(page: np.ndarray, path: Path) -> None:
    image = Image.fromarray(page).quantize(128, dither=Image.Dither.NONE)
    write(path, lambda name: image.save(name, format="PNG", optimize=True))


def main() -> int:
    options = parser().parse_args()
    shape = pw.load_shape(mesh_assembly(bracket(), 256), unit="mm", up="z")
    camera = Camera(azimuth=32.0, elevation=32.0, up="z", margin=0.08)
    view = camera.fitted(shape.vertices, PANEL, PANEL)
    given = look(Scene(shape.vertices, shape.faces), camera, view, PANEL, PANEL).image(np.array(NEUTRAL))
    fits = {method: pw.fit(shape, method, seed=0) for method in ("superfrusta", "solids")}
    panels, captions = [given], ["input"]
    for method, result in fits.items():
        panels.append(coloured(result.assembly, camera, shape.vertices))
        captions.append(f"{method}: {len(result.assembly)} parts, IoU {result.scores.iou:.3f}")
    save(sheet(panels, captions), options.images / "solids.png")
    print(fits["solids"].assembly.describe(), "")
    searched = pw.fit(shape, "solids", seed=0, profiles=False).assembly
    cleaned = pw.clean(searched, shape)
    before, after = (coloured(one, camera, shape.vertices) for one in (searched, cleaned.assembly))
    page = sheet([before, after], ["fitted", "cleaned"])
    texts = [
        [line for part in one.parts for line in textwrap.wrap(part.describe(), LETTERS)]
        for one in (searched, cleaned.assembly)
    ]
    print(searched.describe(), cleaned.assembly.describe(), sep="\n\n")
    print("", *cleaned.relations, "", cleaned.before, cleaned.after, sep="\n")
    rows = max(map(len, texts))
    columns = [written(text + [""] * (rows - len(text)), PANEL) for text in texts]
    save(np.concatenate([page, np.concatenate(columns, axis=1)]), options.images / "clean.png")
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    result.add_argument("--images", type=Path, default=IMAGES, metavar="FOLDER", help="where they go")
    return result


if __name__ == "__main__":
    sys.exit(main())
