"""Pictures that may show no shape of the family: how like its pictures they are, their outline, and their
mirror image.

How like they are is learned (`likeness`); the limit is taken from pictures of shapes that the encoder did not
learn from, before plain backgrounds and others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
import torch
import trimesh

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import EmptyShapeError
from partwright.partsdf.image_encoder import ImageEncoder
from partwright.partsdf.lighting import backgrounds
from partwright.partsdf.photos import Looked, Photo, look_at
from partwright.partsdf.standpoint import Standpoint, find_standpoint, outline
from partwright.partsdf.views import SIDE
from partwright.render import Camera, render_mesh
from partwright.render.raycast import Scene

COVERED = 0.6  # IoU of the moved parts' outline with what is seen, at least; 0.9 is usual
MIRRORED = 0.8  # IoU with what is seen in the mirror image, at least
_SHAPES, _PIXELS = 32, 4 * SIDE
_UNUSUAL = 0.05  # of the pictures of validation shapes lie below the limit
_BETWEEN = 0.25  # the way from 0 to them, where they lie above
NO_LIMIT = -99.0  # a likeness that everything has
_ELEVATIONS = (5.0, 40.0)  # degrees


def warnings_of(encoder: ImageEncoder, looked: Looked, covered: float = 1.0) -> list[str]:
    """One line where a picture may show no shape of the family that the encoder knows, else none. covered:
    IoU of the outline of what was found, moved, with what is seen."""
    said = []
    if covered < COVERED:
        said.append(
            f"however parts are moved, their outline agrees with the silhouette to {100 * covered:.0f} %"
        )
    if looked.sight.likeness < encoder.usual:
        said.append("it looks unlike nearly all pictures of these")
    if looked.mirrored < MIRRORED:
        said.append("something else is seen in its mirror image")
    if not said:
        return []
    return [
        f"this may be no picture of a shape of the family that {encoder.model.name} knows: "
        f"{', and '.join(said)}; look at the picture of the parts, or cut the shape out of the picture"
    ]


def usual_likeness(encoder: ImageEncoder, shapes: Sequence[PreparedShape], seed: int = 0) -> float:
    """The likeness that a few of the pictures of shapes are below, which it did not learn from. Above 0 a
    picture is liker the family's than those of heaps; where these few lie above, a quarter of theirs."""
    found = []
    for photo in _pictures(shapes, encoder.model.up, seed):
        with suppress(EmptyShapeError):  # nothing is seen, which is told by itself
            found.append(look_at(encoder, photo).sight.likeness)
    if not found:
        return NO_LIMIT
    few = float(np.quantile(found, _UNUSUAL))
    return few if few < 0 else _BETWEEN * few


def held_out(family: PreparedFamily) -> list[PreparedShape]:
    """Some of the validation shapes; training shapes where there are no others."""
    names = family.split("validation") or family.split("train")
    return [family.load(name) for name in names[:_SHAPES]]


def standpoint_of(looked: Looked, surface: trimesh.Trimesh) -> Standpoint:
    """Where what was seen is seen from. surface: its mesh."""
    sight = looked.sight
    toward = sight.azimuth, sight.elevation, sight.shape.model.up
    return find_standpoint(surface.vertices, surface.faces, looked.silhouette, *toward)


def _pictures(shapes: Sequence[PreparedShape], up: str, seed: int) -> Iterator[Photo]:
    """Two of each shape, from anywhere and of any colour: on the ground of a render, and before whatever."""
    rng, generator = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
    size = (_PIXELS, _PIXELS)
    for shape in shapes:
        mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
        behind = backgrounds(1, generator)[0].permute(1, 2, 0).numpy()
        behind = behind.repeat(_PIXELS // SIDE, axis=0).repeat(_PIXELS // SIDE, axis=1)
        for ground in (True, False):
            azimuth, elevation = rng.uniform(0, 360), rng.uniform(*_ELEVATIONS)
            camera = Camera(azimuth, elevation, up=up, margin=0.1)
            bright = rng.integers(40, 220, 3)
            grey = rng.random()  # most things are less colourful
            colour = tuple(np.rint((1 - grey) * bright + grey * bright.mean()).astype(int).tolist())
            image = render_mesh(mesh, camera, size, colour, ground) / np.float32(255)
            if not ground:
                there = outline(Scene(mesh.vertices, mesh.faces), camera, _PIXELS)
                image = np.where(there[..., None], image, behind)
            yield Photo(image, None)
