"""What is to be seen at places of an assembly's surface: the input's looks there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.rows import dots, lengths, units
from partwright.shapes.sampling import sample_triangles
from partwright.textures.colours import Colours, barycentric
from partwright.textures.cut_outs import all_three, first_shown

if TYPE_CHECKING:
    from partwright.render.camera import Camera

Floats = NDArray[np.float64]
_Place = tuple[NDArray[np.int64], Floats]  # faces (N,) and barycentric weights (N, 3)

_PER_TEXEL = 3  # samples of the surface
_MOST_SAMPLES = 3_000_000
_AT_ONCE = 1 << 17
_VIEWS = 24
_HELD = 6  # views more, that maps are judged by
_SIDE = 384  # pixels
_APART = 0.03  # of the longest side: where a ray meets both further apart, they are not the same place
_UNSEEN = 0.5  # weight of a sample beside that of a pixel


@dataclass(frozen=True)
class Sightings:
    """points (N, 3) of the assembly's surface, its normals (N, 3), colours (N, 3) and normals (N, 3) of the
    input there, and weights (N,). sampled: they are of the whole surface, not of a view. held: they are no
    part of what maps are made of, but to judge them by."""

    points: Floats
    smooth: Floats
    colours: Floats
    normals: Floats
    weights: Floats
    sampled: bool
    held: bool


def sightings(assembly: Assembly, colours: Colours, size: int, seed: int, views: bool) -> Iterator[Sightings]:
    """Of samples of all the surface, by the place nearest to each, and of pixels of views from all around.

    size: texels a side of a map.
    """
    from partwright.meshing import mesh_assembly
    from partwright.render.raycast import Scene

    mesh = mesh_assembly(assembly)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    here, there = Scene(vertices, faces), Scene(colours.vertices, colours.faces)

    def at(points: Floats, own: _Place, its: _Place, weight: float, held: bool = False) -> Sightings:
        smooth = units(np.einsum("nc,ncd->nd", own[1], here.corner_normals[own[0]].astype(np.float64)))
        # A side that faces inwards counts as its other one does.
        turned = dots(here.face_normals[own[0]], there.face_normals[its[0]])[:, None]
        normals = np.where(turned < 0, -1.0, 1.0) * colours.normals_on_faces(*its)
        weights = np.full(len(points), weight)
        return Sightings(points, smooth, colours.on_faces(*its), normals, weights, weight < 1, held)

    count = min(_MOST_SAMPLES, _PER_TEXEL * size * size * max(1, len(assembly)))
    points, face = sample_triangles(vertices, faces, count, seed)
    for start in range(0, count, _AT_ONCE):
        some, on_face = points[start : start + _AT_ONCE], face[start : start + _AT_ONCE]
        its = colours.nearest(some)
        kept = colours.shown(*its)
        some, on_face, its = some[kept], on_face[kept], (its[0][kept], its[1][kept])
        yield at(some, (on_face, barycentric(vertices[faces[on_face]], some)), its, _UNSEEN)
    reach = _APART * there.size
    for i in range(_VIEWS + _HELD if views else 0):
        held = i >= _VIEWS
        camera = _camera(i - _VIEWS, _HELD, 1.0) if held else _camera(i, _VIEWS, 0.0)
        view = camera.fitted(vertices, _SIDE, _SIDE)
        rays = view.rays(_SIDE, _SIDE)
        eyes = np.broadcast_to(view.eye, rays.shape)
        mine, distance, weights = here.first_hit(eyes, rays)
        struck, far, others = first_shown(there, colours, eyes, rays)
        with np.errstate(invalid="ignore"):  # inf - inf, of rays that miss both
            met = np.flatnonzero(np.abs(distance - far) * lengths(rays) < reach)
        on = mine[met].astype(np.int64), all_three(weights[met])
        seen = struck[met], others[met]
        yield at(view.eye + distance[met, None] * rays[met], on, seen, 1.0, held)


def _camera(i: int, count: int, start: float) -> Camera:
    """One of `count` from all around, spread as evenly as may be; start: of the first azimuth."""
    from partwright.render.camera import Camera

    azimuth = start + i * math.pi * (3 - math.sqrt(5))
    return Camera(math.degrees(azimuth), math.degrees(math.asin(1 - (2 * i + 1) / count)))
