"""The robot at rest: its collision meshes as they were, and the shapes that stand for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.palette import palette
from partwright.meshing.manifolds import surface_of
from partwright.render import Camera, render_mesh, sheet, write_png
from partwright.robots.containment import shape_solid
from partwright.robots.model import RobotFile, Shape
from partwright.robots.solids import Solids

if TYPE_CHECKING:
    from manifold3d import Manifold

_PANEL = (560, 620)


def picture(robot: RobotFile, shapes: Mapping[str, Sequence[Shape]], path: Path) -> None:
    """Write a PNG: before, in a colour a link, and after, in a colour a shape."""
    solids, before, after = Solids(), [], []
    for link in robot.links:
        if link.name not in shapes:
            continue
        before.append(solids.target(link, link.collisions).solid.transform(link.pose[:3]))
        after.append([shape_solid(shape).transform(link.pose[:3]) for shape in shapes[link.name]])
    colours = palette(len(before))
    many = palette(sum(map(len, after)))
    first, last = _drawn(before, colours), _drawn([one for link in after for one in link], many)
    count = sum(map(len, after))
    captions = (f"{len(before)} links, as they were", f"{count} shape{'s' * (count != 1)}")
    write_png(path, sheet([first, last], captions))


def _drawn(solids: Sequence[Manifold], colours: np.ndarray) -> np.ndarray:
    import trimesh

    vertices, faces, each, first = [], [], [], 0
    for solid, colour in zip(solids, colours, strict=True):
        corners, triangles = surface_of(solid)
        vertices.append(corners)
        faces.append(triangles + first)
        each.append(np.broadcast_to(colour, (len(triangles), 3)))
        first += len(corners)
    mesh = trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)
    return render_mesh(mesh, Camera(up="z", margin=0.08), _PANEL, np.concatenate(each), ground=False)
