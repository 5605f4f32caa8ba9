"""Parts' meshes in their maps, for formats that have images and texture coordinates."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.atomic_nodes import atomic_mesh
from partwright.assembly import Assembly, Node, Part
from partwright.meshing import lean_part, mesh_part
from partwright.shapes.corner_normals import corner_normals
from partwright.textures.maps import RELIEF, part_map
from partwright.textures.unwrapping import unwrapped

if TYPE_CHECKING:
    import trimesh
    from PIL.Image import Image


CORNERS = "corner_normals"
"""Of a mesh's faces' attributes."""


@dataclass(frozen=True, eq=False)
class Textured:
    """A mesh, coordinates (V, 2) of its vertices from the image's lower left, the image, and the normal map,
    if any; then the mesh has NORMAL and TANGENT among its vertices' attributes."""

    mesh: trimesh.Trimesh
    uv: NDArray[np.float64]
    image: Image
    relief: Image | None = None

    @property
    def png(self) -> bytes:
        return _png(self.image)

    @property
    def relief_png(self) -> bytes:
        """None is empty."""
        return _png(self.relief) if self.relief is not None else b""


def own_mesh(part: Part, resolution: int) -> trimesh.Trimesh:
    """A part's mesh in its frame, with no more triangles than it needs; with all of them where it has a map,
    which is read at their corners.

    Raises:
        NoSurfaceError: it has no volume.
    """
    alone = Part(part.field)
    return lean_part(alone, resolution) if part_map(part) is None else mesh_part(alone, resolution)


def whole_mesh(node: Node, assembly: Assembly) -> trimesh.Trimesh:
    """`atomic_mesh`, likewise; it is shown in the map of its first part."""
    return atomic_mesh(node, assembly, lean=part_map(node.parts[0]) is None)


def textured(mesh: trimesh.Trimesh, part: Part, placed: bool = False) -> Textured | None:
    """The mesh with the part's maps; None where it has none of colours.

    placed: the mesh is where the part is, not in its frame. Normals of the faces' corners (F, 3, 3) may be
    among its faces' attributes, as CORNERS; else they are those of the mesh, smooth between creases.
    """
    from PIL import Image

    texture, relief = part_map(part), part_map(part, RELIEF)
    if texture is None:
        return None
    pose = part.pose
    normals: Any = None
    if placed:
        mesh = mesh.copy()
        mesh.vertices = pose.inverse()(np.asarray(mesh.vertices))
    if relief is not None:
        normals = mesh.face_attributes.get(CORNERS)
        if normals is None:
            normals = corner_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    result, uv, image = unwrapped(mesh, part.field, texture, normals)
    if placed:
        result.vertices = pose(np.asarray(result.vertices))
        for name, known in result.vertex_attributes.items():
            turned = np.array(known)
            turned[:, :3] = pose.turned(turned[:, :3])
            result.vertex_attributes[name] = turned
    return Textured(result, uv, image, None if relief is None else Image.fromarray(relief.image[::-1]))


def _png(image: Image) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG", optimize=True)
    return out.getvalue()


def own_colour(part: Part) -> NDArray[np.uint8] | None:
    """The colour (3,), sRGB, that its metadata has, as parts without an end get of a textured shape."""
    said = str(part.metadata.get("colour", ""))
    known = re.fullmatch("#[0-9a-fA-F]{6}", said)
    return np.frombuffer(bytes.fromhex(said[1:]), np.uint8) if known else None
