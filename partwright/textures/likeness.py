"""How near parts in their maps come to the input that they stand for: PSNR of pictures without light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.rows import crosses, dots, units
from partwright.textures.colours import Colours
from partwright.textures.coordinates import frames, of_nearest_copy
from partwright.textures.cut_outs import all_three, first_shown
from partwright.textures.maps import RELIEF, part_map

if TYPE_CHECKING:
    from partwright.render.camera import View
    from partwright.render.raycast import Scene

Floats = NDArray[np.float64]

SIDE = 512  # pixels
VIEWS = 8
_AMBIENT = 0.2
_NEVER = 1e-9  # of a squared step of 255: pictures that are the same have 130 dB


def around(vertices: Floats, up: str | None) -> list[View]:
    """Eight views around the points (V, 3), from a little above and below in turn."""
    from partwright.render.camera import Camera

    cameras = [
        Camera(azimuth=360 * i / VIEWS, elevation=25 if i % 2 == 0 else -10, up=up or "y")
        for i in range(VIEWS)
    ]
    return [camera.fitted(vertices, SIDE, SIDE) for camera in cameras]


def seen(
    scene: Scene, view: View, colours: Colours | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Pixels (N,) that meet the scene, faces (N,), barycentric weights (N, 3) and places (N, 3); colours: of
    the scene's surface, whose cut-outs are no surface."""
    rays = view.rays(SIDE, SIDE)
    eyes = np.broadcast_to(view.eye, rays.shape)
    if colours is not None:
        face, distance, weights = first_shown(scene, colours, eyes, rays)
    else:
        found, distance, uv = scene.first_hit(eyes, rays)
        face, weights = found.astype(np.int64), all_three(uv)
    pixel = np.flatnonzero(face >= 0)
    return pixel, face[pixel], weights[pixel], view.eye + distance[pixel, None] * rays[pixel]


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
            result[mine] = texture.at(part.field, of_nearest_copy(part, points[mine])[0])
    return result


def map_normals(assembly: Assembly, points: Floats, smooth: Floats) -> Floats:
    """Normals (N, 3) at points (N, 3) of the surface, whose own are `smooth`, as parts' maps bend them."""
    owner = np.abs(assembly.part_distances(points)).argmin(axis=0)
    result = smooth.copy()
    for i, part in enumerate(assembly.parts):
        mine = np.flatnonzero(owner == i)
        relief = part_map(part, RELIEF)
        if relief is None or not len(mine):
            continue
        axes = (np.broadcast_to(axis, (len(mine), 3)) for axis in np.eye(3))
        own, away, *axes_there = of_nearest_copy(part, points[mine], smooth[mine], *axes)
        across, turned = frames(part.field, own, away)
        up = turned[:, None] * crosses(away, across)
        x, y, z = (relief.at(part.field, own) / 127.5 - 1).T[:, :, None]
        bent = units(x * across + y * up + z * away)
        result[mine] = np.stack([dots(bent, axis) for axis in axes_there], axis=1)
    return result


def shaded(colours: Floats, normals: Floats, view: View) -> Floats:
    """Colours (N, 3) in light from over the viewer's left shoulder; normals (N, 3) away from the surface."""
    light = view.back + 0.5 * view.up - 0.5 * view.right
    share = np.maximum(normals @ (light / np.linalg.norm(light)), 0)
    return (_AMBIENT + (1 - _AMBIENT) * share)[:, None] * colours


def likeness(
    assemblies: Sequence[Assembly], colours: Colours, lit: bool = False
) -> list[tuple[float, float]]:
    """Of assemblies that differ in their maps alone: mean PSNR, in dB, of whole pictures, outlines and all,
    and of the pixels where both are met.

    lit: with light, which shows the normals, and the same white surface instead of colours.

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
        pixel, face, weights, _ = seen(truth, view, colours)
        own, mine, shares, places = seen(parts, view)
        if lit:
            normals = colours.normals_on_faces(face, weights)
            normals[truth.face_normals[face] @ view.back < 0] *= -1
            want = picture(pixel, shaded(np.full((len(pixel), 3), 255.0), normals, view))
            white = np.full((len(own), 3), 255.0)
            smooth = np.einsum("nc,ncd->nd", shares, parts.corner_normals[mine].astype(np.float64))
            smooth = units(smooth)
            each = [picture(own, shaded(white, map_normals(one, places, smooth), view)) for one in assemblies]
        else:
            want = picture(pixel, colours.on_faces(face, weights))
            each = [picture(own, map_colours(one, places)) for one in assemblies]
        both = np.intersect1d(own, pixel)
        scores.append([(psnr(one, want), psnr(one[both], want[both])) for one in each])
    return [(float(whole), float(surface)) for whole, surface in np.mean(scores, axis=0)]


def without_relief(assembly: Assembly) -> Assembly:
    """The same with smooth parts."""
    for part in assembly.parts:
        if RELIEF in part.metadata:
            kept = {key: value for key, value in part.metadata.items() if key != RELIEF}
            assembly = assembly.replace_part(part.name, replace(part, metadata=kept))
    return assembly
