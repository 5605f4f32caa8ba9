"""Pictures that may show no shape of the family: what is seen in them, held against what is usual.

How far outlines agree, or how sure an encoder is, differs from family to family: a mixer looks alike from
behind, a car always has all of its parts. So limits are taken from pictures of shapes that the encoder did
not learn from, before plain backgrounds and others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import astuple

import numpy as np
import torch
import trimesh

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import EmptyShapeError, NoSurfaceError
from partwright.partsdf.image_encoder import ImageEncoder, Limits
from partwright.partsdf.lighting import backgrounds
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.photos import Looked, Photo, look_at
from partwright.partsdf.standpoint import Standpoint, find_standpoint, outline
from partwright.partsdf.views import SIDE
from partwright.render import Camera, render_mesh
from partwright.render.raycast import Scene

MIRRORED = 0.8  # IoU with what is seen in the mirror image, at least
_SHAPES, _CELLS, _PIXELS = 16, 48, 2 * SIDE
_UNUSUAL = 0.15  # of the pictures of validation shapes that lie beyond each limit: what tells most of others
SURE = Limits(covered=0.9, certain=0.9, odd=0.5, doubt=0.02)  # no limit is stricter: a picture is never whole
_ELEVATIONS = (5.0, 40.0)  # degrees


def warnings_of(encoder: ImageEncoder, looked: Looked, standpoint: Standpoint) -> list[str]:
    """One line where a picture may show no shape of the family that the encoder knows, else none."""
    said, sight, limits = [], looked.sight, encoder.limits
    if looked.mirrored < MIRRORED:
        said.append("something else is seen in its mirror image")
    if standpoint.iou < limits.covered:
        said.append(
            f"the outline of what was found agrees with the silhouette to {100 * standpoint.iou:.0f} %, less "
            f"than the {100 * limits.covered:.0f} that are usual"
        )
    if sight.certainty < limits.certain:
        said.append("it is not clear from which side it is seen")
    if sight.doubt > limits.doubt:
        said.append("it is not clear which parts there are")
    if sight.oddness > limits.odd:
        said.append("its parts are placed unlike those of the family")
    if not said:
        return []
    return [
        f"this may be no picture of a shape of the family that {encoder.model.name} knows: "
        f"{', and '.join(said)}; look at the picture of the parts, or cut the shape out of the picture"
    ]


def usual_limits(encoder: ImageEncoder, family: PreparedFamily, seed: int = 0) -> Limits:
    """The limits that a few of the pictures of validation shapes lie beyond, of each; of training shapes
    where there are no others."""
    names = family.split("validation") or family.split("train")
    shapes = [family.load(name) for name in names[:_SHAPES]]
    signs = []
    for photo in _pictures(shapes, encoder.model.up, seed):
        try:
            looked = look_at(encoder, photo)
            found = standpoint_of(looked, mesh_shape(looked.sight.shape, _CELLS, parts=False).whole)
        except (EmptyShapeError, NoSurfaceError):
            continue  # nothing is seen, which is told by itself
        sight = looked.sight
        signs.append(astuple(Limits(found.iou, sight.certainty, sight.oddness, sight.doubt)))
    if not signs:
        return SURE
    low, high = np.quantile(signs, (_UNUSUAL, 1 - _UNUSUAL), axis=0).tolist()
    return Limits(
        covered=min(SURE.covered, low[0]),
        certain=min(SURE.certain, low[1]),
        odd=max(SURE.odd, high[2]),
        doubt=max(SURE.doubt, high[3]),
    )


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
        for ground in (True, False):
            azimuth, elevation = rng.uniform(0, 360), rng.uniform(*_ELEVATIONS)
            camera = Camera(azimuth, elevation, up=up, margin=0.1)
            colour = tuple(rng.integers(40, 220, 3).tolist())
            image = render_mesh(mesh, camera, size, colour, ground) / np.float32(255)
            if not ground:
                there = outline(Scene(mesh.vertices, mesh.faces), camera, _PIXELS)
                image = np.where(there[..., None], image, behind.repeat(2, axis=0).repeat(2, axis=1))
            yield Photo(image, None)
