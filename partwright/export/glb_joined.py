"""GLB of the one surface that parts make together: each part's node has what of it is that part's.

Parts that are meshed one by one lack what joins them: the blends. Here the whole surface is meshed, blends
and cuts and all, and shared out: each triangle to the part that it is nearest to, as colours are baked, so
maps meet at the seams.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part, Similarity
from partwright.export.texturing import CORNERS
from partwright.meshing import mesh_assembly
from partwright.shapes.corner_normals import corner_normals
from partwright.textures.maps import RELIEF

if TYPE_CHECKING:
    import trimesh


def patches(assembly: Assembly, resolution: int) -> Iterator[tuple[Part, int, Similarity, trimesh.Trimesh]]:
    """Of each copy of a part that has some of the surface: the part, which copy (0 for the part itself), its
    pose, and its triangles, in its frame, with normals of the whole at their corners where a part has a map
    of normals.

    resolution: cells along the longest side of the whole.

    Raises:
        NoSurfaceError: nothing is left of the assembly, or it does not end.
    """
    import trimesh as tm

    mesh = mesh_assembly(assembly, resolution)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    bent = any(RELIEF in part.metadata for part in assembly.parts)  # others need no normals
    corners = corner_normals(vertices, faces).astype(np.float64) if bent else None
    middles = vertices[faces].mean(axis=1)
    owner = np.abs(assembly.part_distances(middles)).argmin(axis=0)
    for i, part in enumerate(assembly.parts):
        mine = np.flatnonzero(owner == i)
        poses = [copy.pose for copy in part.copies]
        nearest = _nearest(part, poses, middles[mine])
        for k, pose in enumerate(poses):
            chosen = mine[nearest == k]
            own = faces[chosen]
            if len(own):
                used, corner = np.unique(own, return_inverse=True)
                back = pose.inverse()
                normals: dict[str, Any] = {} if corners is None else {CORNERS: back.turned(corners[chosen])}
                patch = tm.Trimesh(
                    back(vertices[used]), corner.reshape(-1, 3), face_attributes=normals, process=False
                )
                yield part, k, pose, patch


def add_patches(
    scene: trimesh.Scene,
    assembly: Assembly,
    resolution: int,
    pose: NDArray[np.float64],
    node: Callable[[Part, int], tuple[str, dict[str, object]]],
    looking: Callable[[trimesh.Trimesh, Part], trimesh.Trimesh],
) -> None:
    """Add a node a patch below the scene's root.

    pose: (4, 4) of the whole. node: its name and extras, of a part and the number of its copy. looking: the
    mesh in its colours.

    Raises:
        NoSurfaceError: of `patches`.
    """
    for part, copy, own, mesh in patches(assembly, resolution):
        name, about = node(part, copy)
        placed = pose @ own.matrix()
        scene.add_geometry(looking(mesh, part), name, name, "world", placed, metadata=about)


def _nearest(part: Part, poses: list[Similarity], points: NDArray[np.float64]) -> NDArray[np.int64]:
    """(N,) the copy whose surface is nearest to each point."""
    if len(poses) == 1:
        return np.zeros(len(points), np.int64)
    local = (np.ascontiguousarray(pose.inverse()(points), np.float32) for pose in poses)
    return np.argmin([np.abs(part.field(one)) for one in local], axis=0)
