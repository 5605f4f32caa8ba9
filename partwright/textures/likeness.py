"""How near parts in their maps come to the input that they stand for: PSNR of pictures without light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.textures.colours import Colours
from partwright.textures.coordinates import of_nearest_copy
from partwright.textures.maps import part_map

if TYPE_CHECKING:
    from partwright.render.camera import View
    from partwright.render.raycast import Scene

Floats = NDArray[np.float64]

SIDE = 512  # pixels
VIEWS = 8
_NEVER = 1e-9  # of a squared step of 255: pictures that are the same have 130 dB


def around(vertices: Floats, up: str | None) -> list[View]:
    """Eight views around the points (V, 3), from a little above and below in turn."""
    from partwright.render.camera import Camera

    cameras = [
        Camera(azimuth=360 * i / VIEWS, elevation=25 if i % 2 == 0 else -10, up=up or "y")
        for i in range(VIEWS)
    ]
    return [camera.fitted(vertices, SIDE, SIDE) for camera in cameras]


def seen(scene: Scene, view: View) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Pixels (N,) that meet the scene, faces (N,), barycentric weights (N, 3) and places (N, 3)."""
    rays = view.rays(SIDE, SIDE)
    face, distance, uv = scene.first_hit(np.broadcast_to(view.eye, rays.shape), rays)
    pixel = np.flatnonzero(face >= 0)
    u, v = uv[pixel].T
    weights = np.stack([1 - u - v, u, v], axis=1)
    return pixel, face[pixel].astype(np.int64), weights, view.eye + distance[pixel, None] * rays[pixel]


def picture(pixel: NDArray[np.int64], colours: Floats) -> Floats:
    """All pixels (SIDE^2, 3), white but for those (N,) of these colours (N, 3), 0 to 255."""
    result = np.full((SIDE * SIDE, 3), 255.0)
    result[pixel] = colours
    return result


def psnr(a: Floats, b: Floats) -> float:
    """Of colours, 0 to 255, in dB."""
    return float(10 * np.log10(255**2 / max(float(((a - b) ** 2).mean()), _NEVER)))


def map_colours(assembly: Assembly, points: Floats) -> Floats:
    """Colours (N, 3) of the maps at points (N, 3) of the surface; a part without map has its one colour."""
    owner = np.abs(assembly.part_distances(points)).argmin(axis=0)
    result = np.zeros((len(points), 3))
    for i, part in enumerate(assembly.parts):
        mine = np.flatnonzero(owner == i)
        texture = part_map(part)
        if not len(mine):
            continue
        if texture is None:
            said = str(part.metadata.get("colour", "#000000"))
            result[mine] = [int(said[k : k + 2], 16) for k in (1, 3, 5)]
        else:
            result[mine] = texture.at(part.field, of_nearest_copy(part, points[mine]))
    return result


def likeness(assemblies: Sequence[Assembly], colours: Colours) -> list[tuple[float, float]]:
    """Of assemblies that differ in their maps alone: mean PSNR, in dB, of whole pictures, outlines and all,
    and of the pixels where both are met.

    Raises:
        NoSurfaceError: nothing is inside of the assembly.
    """
    from partwright.meshing import mesh_assembly
    from partwright.render.raycast import Scene

    mesh = mesh_assembly(assemblies[0])
    parts = Scene(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    truth = Scene(colours.vertices, colours.faces)
    scores = []
    for view in around(colours.vertices, assemblies[0].up):
        pixel, face, weights, _ = seen(truth, view)
        own, _, _, places = seen(parts, view)
        want, both = picture(pixel, colours.on_faces(face, weights)), np.intersect1d(own, pixel)
        each = [picture(own, map_colours(one, places)) for one in assemblies]
        scores.append([(psnr(one, want), psnr(one[both], want[both])) for one in each])
    return [(float(whole), float(surface)) for whole, surface in np.mean(scores, axis=0)]
