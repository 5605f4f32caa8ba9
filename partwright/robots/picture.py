"""The robot at rest: what collides as it was, the shapes that stand for its meshes, and spheres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.palette import palette
from partwright.meshing.manifolds import surface_of
from partwright.render import Camera, render_mesh, sheet, write_png
from partwright.robots.containment import shape_solid
from partwright.robots.covering import balls_solid
from partwright.robots.model import RobotFile, Shape
from partwright.robots.solids import Solids
from partwright.robots.spheres import LinkSpheres
from partwright.shapes.cleaning import counted

if TYPE_CHECKING:
    from manifold3d import Manifold

_PANEL = (560, 620)


def picture(
    robot: RobotFile, shapes: Mapping[str, Sequence[Shape]], spheres: Sequence[LinkSpheres], path: Path
) -> None:
    """Write a PNG: before, in a colour a link; after, in a colour a shape; and spheres, if there are some, in
    a colour a link. Native solids, which stay, are in all of them."""
    from manifold3d import Manifold, OpType

    solids, before, after = Solids(), [], []
    links = [link for link in robot.links if link.name in shapes or link.natives]
    for link in links:
        own = [shape_solid(Shape("", part)) for part in link.natives]
        meshes = [solids.target(link, link.collisions).solid] if link.name in shapes else []
        before.append(Manifold.batch_boolean([*meshes, *own], OpType.Add).transform(link.pose[:3]))
        new = [shape_solid(shape) for shape in shapes.get(link.name, ())]
        after += [solid.transform(link.pose[:3]) for solid in (*new, *own)]
    panels = [before, after]
    captions = [f"{counted(len(before), 'link')}, before", counted(len(after), "shape")]
    if spheres:
        poses = {link.name: link.pose[:3] for link in links}
        panels.append([balls_solid(each.balls).transform(poses[each.link]) for each in spheres])
        captions.append(counted(sum(len(each.balls) for each in spheres), "sphere"))
    framed = np.concatenate([surface_of(solid)[0] for panel in panels for solid in panel])
    images = [_drawn(panel, palette(len(panel)), framed) for panel in panels]
    write_png(path, sheet(images, captions))


def _drawn(solids: Sequence[Manifold], colours: np.ndarray, framed: np.ndarray) -> np.ndarray:
    """framed: (V, 3) points that the picture shows, too, so that all have one view."""
    import trimesh

    vertices, faces, each, first = [framed], [], [], len(framed)
    for solid, colour in zip(solids, colours, strict=True):
        corners, triangles = surface_of(solid)
        vertices.append(corners)
        faces.append(triangles + first)
        each.append(np.broadcast_to(colour, (len(triangles), 3)))
        first += len(corners)
    mesh = trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)
    return render_mesh(mesh, Camera(up="z", margin=0.08), _PANEL, np.concatenate(each), ground=False)
