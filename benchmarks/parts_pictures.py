"""Pictures of the page on learned parts: what the models that ship find, and how they are edited.

    python benchmarks/parts_pictures.py --families FOLDER [--only cars] [--seen chairs]

FOLDER holds the prepared families chairs, cars, mixers and vehicles, as configs/ name them. The first test
shapes are reconstructed without labels or poses; edits and interpolations are of training shapes. A mixer's
helix, which hides in its tube, is drawn before it. Pictures go to docs/images/parts/, one a family. `--seen`:
instead, what is found in one picture each of a family's first test shapes, those of
benchmarks/partsdf_images.py.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import trimesh
from partsdf_images import pictures
from PIL import Image

from partwright.assembly.palette import palette
from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.partsdf import Model, NeuralShape, ReconstructionSettings, editing, load_model
from partwright.partsdf.from_photo import needed_encoder, reconstruct_seen
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.pictures import picture, target_picture
from partwright.partsdf.reconstruction import reconstruct_unknown
from partwright.partsdf.targets import Target
from partwright.render import Camera, render_mesh, sheet, write_png

TARGET = Path(__file__).parents[1] / "docs" / "images" / "parts"
CAMERA = Camera(margin=0.12)
PANEL, ITERATIONS = 220, 200
RESOLUTION = {"mixers": 192}  # of thin walls; 96 for the others
BEFORE = {"helix": (0.0, -1.0, -0.1)}  # unit lengths that a hidden part is moved by
SEEN = 6
TESTED, STEPS = 2, 6  # test shapes, pictures of an interpolation


def larger_wheels(car: NeuralShape) -> NeuralShape:
    for part in (name for name in car.model.parts if name.startswith("wheel")):
        car = editing.scaled(car, part, (1.3, 1.3, 1.0))
    return car


def another_back(chair: NeuralShape) -> NeuralShape:
    return editing.swapped(chair, "back", NeuralShape.trained(chair.model, "5"))


def wider_tube(mixer: NeuralShape) -> NeuralShape:
    return editing.scaled(mixer, "tube", (1.2, 1.2, 1.0))


EDITS: dict[str, tuple[str, Callable[[NeuralShape], NeuralShape]]] = {
    "chairs": ("another's back", another_back),
    "cars": ("larger wheels", larger_wheels),
    "mixers": ("a wider tube", wider_tube),
    "vehicles": ("larger wheels", larger_wheels),
}
WAYS = {
    "chairs": ("0", "1"),
    "cars": ("0", "11"),
    "mixers": ("0", "1"),
    "vehicles": ("4", "8"),
}  # ends of interpolations


def page(name: str, family: PreparedFamily) -> np.ndarray:
    """Above what is found in shapes not trained on, and an edit; below the way from one shape to another."""
    model = load_model(name)
    panels, captions = [], []
    for index in family.split("test")[:TESTED]:
        shape = family.load(index)
        panels += [given(shape), found(model, shape)]
        captions += ["given", "parts found"]
    what, edit = EDITS[name]
    first, last = (NeuralShape.trained(model, number) for number in WAYS[name])
    panels += [drawn(first), drawn(edit(first))]
    captions += ["learned", what]
    ways = np.linspace(0, 1, STEPS)
    panels += [drawn(editing.interpolated(first, last, t)) for t in ways]
    captions += [f"{t:.1f}" for t in ways]
    return sheet(panels, captions, columns=STEPS)


def seen(name: str, family: PreparedFamily) -> np.ndarray:
    """Pictures of held-out shapes, what is found from there and from beside, and the truth from beside."""
    encoder = needed_encoder(load_model(name))
    shapes = [family.load(i) for i in family.split("test")[:SEEN]]
    panels, captions = [], []
    plain, cluttered = (list(pictures(shapes, 1, behind)) for behind in (False, True))
    for i in range(len(shapes)):
        truth, _, photo = (cluttered if i % 2 else plain)[i]
        parts = reconstruct_seen(encoder, photo, resolution=96)
        there = replace(parts.camera, margin=0.1)
        aside = replace(there, azimuth=there.azimuth + 60, elevation=22.0)
        image = Image.fromarray(np.rint(255 * photo.pixels).astype(np.uint8)).resize((PANEL, PANEL))
        panels += [np.asarray(image), picture(parts.shape, size=PANEL, camera=there)]
        panels += [picture(parts.shape, size=PANEL, camera=aside), target_picture(truth, PANEL, aside)]
        captions += ["one picture", "parts seen", "from beside", "true parts"]
    return sheet(panels, captions, columns=8)


def given(shape: PreparedShape) -> np.ndarray:
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    return render_mesh(mesh, CAMERA, (PANEL, PANEL))


def found(model: Model, shape: PreparedShape) -> np.ndarray:
    target = Target(torch.tensor(shape.points), torch.tensor(shape.sdf))
    return drawn(reconstruct_unknown(model, target, ReconstructionSettings(iterations=ITERATIONS)))


def drawn(shape: NeuralShape) -> np.ndarray:
    parts = mesh_shape(shape, RESOLUTION.get(shape.model.name, 96)).parts
    colours = palette(len(shape.model.parts))
    meshes = [mesh.copy().apply_translation(BEFORE.get(name, (0, 0, 0))) for name, mesh in parts.items()]
    faces = [np.tile(colours[shape.model.index(name)], (len(mesh.faces), 1)) for name, mesh in parts.items()]
    return render_mesh(trimesh.util.concatenate(meshes), CAMERA, (PANEL, PANEL), np.concatenate(faces))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--families", type=Path, required=True, metavar="FOLDER", help="of prepared families")
    parser.add_argument("--only", default=",".join(EDITS), metavar="A,B", help="of these families")
    parser.add_argument("--seen", metavar="NAME", help="draw what is seen in pictures of this family")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    TARGET.mkdir(parents=True, exist_ok=True)
    if arguments.seen:
        family = PreparedFamily(arguments.families / arguments.seen)
        write_png(TARGET / f"seen_{arguments.seen}.png", seen(arguments.seen, family))
        return 0
    for name in arguments.only.split(","):
        write_png(TARGET / f"{name}.png", page(name, PreparedFamily(arguments.families / name)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
