"""Parts' meshes in their maps, for formats that have images and texture coordinates."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.textures.maps import part_map
from partwright.textures.unwrapping import unwrapped

if TYPE_CHECKING:
    import trimesh
    from PIL.Image import Image


@dataclass(frozen=True, eq=False)
class Textured:
    """A mesh, coordinates (V, 2) of its vertices from the image's lower left, and the image."""

    mesh: trimesh.Trimesh
    uv: NDArray[np.float64]
    image: Image

    @property
    def png(self) -> bytes:
        out = io.BytesIO()
        self.image.save(out, "PNG", optimize=True)
        return out.getvalue()


def textured(mesh: trimesh.Trimesh, part: Part, placed: bool = False) -> Textured | None:
    """The mesh with the part's map; None where it has none.

    placed: the mesh is where the part is, not in its frame.
    """
    texture = part_map(part)
    if texture is None:
        return None
    pose = part.pose
    if placed:
        mesh = mesh.copy()
        mesh.vertices = pose.inverse()(np.asarray(mesh.vertices))
    result, uv, image = unwrapped(mesh, part.field, texture)
    if placed:
        result.vertices = pose(np.asarray(result.vertices))
    return Textured(result, uv, image)


def own_colour(part: Part) -> NDArray[np.uint8] | None:
    """The colour (3,), sRGB, that its metadata has, as parts without an end get of a textured shape."""
    said = str(part.metadata.get("colour", ""))
    known = re.fullmatch("#[0-9a-fA-F]{6}", said)
    return np.frombuffer(bytes.fromhex(said[1:]), np.uint8) if known else None
