"""The picture of docs/capri.md: CAD parts that the project makes itself, and the quadrics found in them.

    python benchmarks/capri_gallery.py

Every part is fitted with seed 0 by the search without ruin and recreate; `--fits FOLDER` takes
FOLDER/NAME/assembly.json instead where there is one. The picture goes to docs/images/capri.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import partwright as pw
from partwright.assembly import Assembly
from partwright.assembly.palette import palette
from partwright.capri import Settings
from partwright.datasets.cad_parts import CadPart, cad_part
from partwright.meshing import mesh_csg
from partwright.methods import FitRequest, Run
from partwright.metrics.complexity import convexes
from partwright.render import Camera, sheet
from partwright.render.output import write
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look
from partwright.render.sheet import SOFT_INK, draw_text
from partwright.shapes import Shape

TARGET = Path(__file__).parents[1] / "docs" / "images" / "capri.png"
NUMBERS = (1, 50, 7, 11, 54, 32)  # of the parts, with seed 3
PANEL = 260
COLUMNS = 3  # shapes side by side


def fitted(part: CadPart, shape: Shape, fits: Path | None) -> Assembly:
    saved = fits / part.name / "assembly.json" if fits else None
    if saved and saved.is_file():
        return pw.load_assembly(saved)
    return FitRequest(shape, Settings(tries=0), Run(threads=1)).fitted().assembly


def panels(part: CadPart, fits: Path | None) -> list[np.ndarray]:
    """Input and result (PANEL, PANEL, 3), the result coloured by quadric and captioned."""
    shape = pw.load_shape(part.mesh, unit="mm", up="z")
    assembly = fitted(part, shape, fits)
    surface = mesh_csg(assembly)
    camera = Camera(azimuth=32.0, margin=0.1)
    given = Scene(shape.vertices, shape.faces)
    made = Scene(np.asarray(surface.vertices), np.asarray(surface.faces))
    view = camera.fitted(np.concatenate([given.vertices, made.vertices]), PANEL, PANEL)
    before, after = (look(scene, camera, view, PANEL, PANEL) for scene in (given, made))
    surface_of = np.abs(assembly.part_distances(after.hits.point)).argmin(axis=0)
    colours = palette(len(assembly))[surface_of]
    caption = f"{part.kind.replace('_', ' ')}: {len(assembly)} quadrics, {convexes(assembly)} convexes"
    coloured = draw_text(after.image(colours), [(PANEL / 2, PANEL - 12, caption)], size=13, colour=SOFT_INK)
    return [before.image(np.array(NEUTRAL)), coloured]


def main() -> int:
    options = parser().parse_args()
    parts = [cad_part(number, seed=3) for number in NUMBERS]
    page = sheet([image for part in parts for image in panels(part, options.fits)], columns=2 * COLUMNS)
    picture = Image.fromarray(page)
    write(options.output, lambda name: picture.save(name, format="PNG", optimize=True))
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    result.add_argument("--fits", type=Path, metavar="FOLDER", help="results of partwright fit, by name")
    result.add_argument("-o", "--output", type=Path, default=TARGET, metavar="PNG", help="where to write")
    return result


if __name__ == "__main__":
    sys.exit(main())
