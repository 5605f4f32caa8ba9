"""What is to be seen at places of an assembly's surface: the input's looks there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.shapes.sampling import sample_triangles
from partwright.textures.colours import Colours

Floats = NDArray[np.float64]

_PER_TEXEL = 3  # samples of the surface
_MOST_SAMPLES = 3_000_000
_AT_ONCE = 1 << 17
_VIEWS = 24
_SIDE = 384  # pixels
_APART = 0.03  # of the longest side: where a ray meets both further apart, they are not the same place
_UNSEEN = 0.05  # weight of a sample beside that of a pixel: views come first, samples fill what they miss


@dataclass(frozen=True)
class Sightings:
    """points (N, 3) of the assembly's surface, colours (N, 3) there, 0 to 255, and weights (N,)."""

    points: Floats
    colours: Floats
    weights: Floats


def sightings(assembly: Assembly, colours: Colours, size: int, seed: int, views: bool) -> Iterator[Sightings]:
    """Of samples of all the surface, by the place nearest to each, and of pixels of views from all around.

    size: texels a side of a map.
    """
    from partwright.meshing import mesh_assembly
    from partwright.render.camera import Camera
    from partwright.render.raycast import Scene

    mesh = mesh_assembly(assembly)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    count = min(_MOST_SAMPLES, _PER_TEXEL * size * size * max(1, len(assembly)))
    points, _ = sample_triangles(vertices, faces, count, seed)
    for start in range(0, count, _AT_ONCE):
        some = points[start : start + _AT_ONCE]
        yield Sightings(some, colours.at(some), np.full(len(some), _UNSEEN))
    if not views:
        return
    here, there = Scene(vertices, faces), Scene(colours.vertices, colours.faces)
    reach = _APART * there.size
    for i in range(_VIEWS):
        height = 1 - (2 * i + 1) / _VIEWS
        camera = Camera(math.degrees(i * math.pi * (3 - math.sqrt(5))), math.degrees(math.asin(height)))
        view = camera.fitted(vertices, _SIDE, _SIDE)
        rays = view.rays(_SIDE, _SIDE)
        eyes = np.broadcast_to(view.eye, rays.shape)
        _, own, _ = here.first_hit(eyes, rays)
        face, distance, uv = there.first_hit(eyes, rays)
        length = np.linalg.norm(rays, axis=1)
        with np.errstate(invalid="ignore"):  # inf - inf, of rays that miss both
            met = np.flatnonzero(np.abs(own - distance) * length < reach)
        u, v = uv[met].T
        seen = colours.on_faces(face[met].astype(np.int64), np.stack([1 - u - v, u, v], axis=1))
        yield Sightings(view.eye + own[met, None] * rays[met], seen, np.ones(len(met)))
