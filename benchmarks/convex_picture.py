"""The picture of docs/export-robotics.md: a drilled bracket, its hull, and the convex pieces that MJCF gets.

python benchmarks/convex_picture.py
"""

from __future__ import annotations

import json
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
import trimesh
from solids_picture import IMAGES, PANEL, bracket

import partwright as pw
from partwright.assembly.palette import palette
from partwright.meshing import mesh_assembly
from partwright.render import Camera, sheet
from partwright.render.output import write_png
from partwright.render.raycast import Scene
from partwright.render.shading import NEUTRAL, look

CAMERA = Camera(azimuth=32.0, elevation=32.0, up="z", margin=0.08)
APART = 1.25  # of where pieces lie


def drawn(meshes: list[trimesh.Trimesh], colours: np.ndarray, around: np.ndarray) -> np.ndarray:
    """Meshes, each in its colour (N, 3), as seen by a camera that is fitted to the points `around`."""
    whole = trimesh.util.concatenate(meshes)
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    view = CAMERA.fitted(around, PANEL, PANEL)
    seen = look(Scene(np.asarray(whole.vertices), np.asarray(whole.faces)), CAMERA, view, PANEL, PANEL)
    return seen.image(colours[owner[seen.hits.face]])


def pieces(path: Path) -> list[trimesh.Trimesh]:
    """The meshes and boxes of an MJCF file."""
    root = xml.parse(path).getroot()
    numbers = {mesh.get("name"): mesh for mesh in root.iter("mesh")}
    found = []
    for geom in root.iter("geom"):
        mesh = numbers.get(geom.get("mesh"))
        if mesh is not None:
            vertices = np.array(mesh.get("vertex", "").split(), dtype=float).reshape(-1, 3)
            found.append(
                trimesh.Trimesh(vertices, np.array(mesh.get("face", "").split(), int).reshape(-1, 3))
            )
        elif geom.get("type") == "box":
            size, place = (np.array(geom.get(name, "").split(), dtype=float) for name in ("size", "pos"))
            found.append(trimesh.creation.box(2 * size, trimesh.transformations.translation_matrix(place)))
    return found


def main() -> int:
    assembly = bracket()
    given = mesh_assembly(assembly, 256)
    given.apply_scale(1e-3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bracket.mjcf.xml"
        pw.export(assembly, path, tolerance=0.02)
        made = pieces(path)
        told = json.loads(path.with_name(path.name + ".report.json").read_text())["approximated"]
    middle = given.bounds.mean(axis=0)
    apart = [one.copy().apply_translation((APART - 1) * (one.center_mass - middle)) for one in made]
    around = np.concatenate([one.vertices for one in apart])
    grey = np.array([NEUTRAL])
    panels = [
        drawn([given], grey, around),
        drawn([given.convex_hull], grey, around),
        drawn(apart, palette(len(made)), around),
    ]
    captions = ["assembly", "its hull: the holes are gone", f"MJCF: {len(made)} convex pieces, drawn apart"]
    write_png(IMAGES / "convex_pieces.png", sheet(panels, captions))
    print(
        *(f"{one['to']}: {', '.join(one['parts'])}, {one['volume_error_ratio']:.3f}" for one in told),
        sep="\n",
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
