"""A part's mesh with its map as an image and texture coordinates, for formats that have these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.fields import Field
from partwright.rows import units
from partwright.textures.coordinates import directions, folded, frames
from partwright.textures.maps import PartMap

if TYPE_CHECKING:
    import trimesh

Floats = NDArray[np.float64]


def unwrapped(
    mesh: trimesh.Trimesh, field: Field, texture: PartMap, normals: Floats | None = None
) -> tuple[trimesh.Trimesh, Floats, Any]:
    """The mesh cut where the map has its folds, uv (V, 2) from the image's lower left, and the image (PIL).

    mesh: in the field's own frame. Its triangles are cut along the planes between the octants of directions,
    so that each lies within one of them and has coordinates that do not jump. normals (F, 3, 3): of its
    faces' corners, in that frame; then the result has NORMAL (V, 3) and TANGENT (V, 4) among its vertices'
    attributes, as glTF means them: directions along the map's rows, and 1 where up is normal x tangent.
    """
    import trimesh as tm
    from PIL import Image

    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    around = np.zeros((len(vertices), 0))
    if normals is not None:  # a vertex at a crease becomes several
        each = np.asarray(normals, np.float64).reshape(-1, 3)
        key = np.column_stack([faces.ravel(), each])
        _, first, back = np.unique(key, axis=0, return_index=True, return_inverse=True)
        vertices, around = vertices[faces.ravel()[first]], each[first]
        faces = back.reshape(-1, 3)
    towards, inner = directions(field, vertices)
    # Vertices, directions, sides and normals are cut alike.
    values = np.column_stack([vertices, towards, inner.astype(np.float64), around])
    for axis in (3, 4, 5):
        values, faces = _cut(values, faces, axis)
    middle = values[faces].mean(axis=1)
    octant = np.where(middle[:, 3:6] < 0, -1.0, 1.0)
    hidden = (middle[:, 6] > 0.5) & (texture.sides == 2)
    corner = faces.ravel()
    kind = np.repeat(np.column_stack([octant, hidden]), 3, axis=0)
    _, first, back = np.unique(
        np.column_stack([corner, kind]), axis=0, return_index=True, return_inverse=True
    )
    place = folded(values[corner[first], 3:6], kind[first, :3])
    # Half a texel from the border, so that no reader's filter mixes the two sides.
    place = np.clip(place, 0.5 / texture.size, 1 - 0.5 / texture.size)
    place[:, 0] = (place[:, 0] + kind[first, 3]) / texture.sides
    result = tm.Trimesh(values[corner[first], :3], back.reshape(-1, 3), process=False)
    if normals is not None:
        smooth = units(values[corner[first], 7:])
        across, turned = frames(field, values[corner[first], :3], smooth, kind[first, :3])
        result.vertex_attributes["NORMAL"] = smooth
        result.vertex_attributes["TANGENT"] = np.column_stack([across, turned])
    return result, place, Image.fromarray(texture.image[::-1])


def _cut(values: Floats, faces: NDArray[np.int64], axis: int) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles cut where column `axis` of the values (V, D) changes its sign; new vertices lie between."""
    side = np.sign(np.where(np.abs(values[:, axis]) < 1e-9, 0.0, values[:, axis]))
    corner = side[faces]
    crossed = (corner.max(axis=1) > 0) & (corner.min(axis=1) < 0)
    if not crossed.any():
        return values, faces
    edges = np.sort(faces[crossed][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    cut = np.unique(edges[side[edges[:, 0]] * side[edges[:, 1]] < 0], axis=0)
    a, b = values[cut[:, 0]], values[cut[:, 1]]
    share = (a[:, axis] / (a[:, axis] - b[:, axis]))[:, None]
    between = a + share * (b - a)
    between[:, axis] = 0
    number = {(int(i), int(j)): len(values) + n for n, (i, j) in enumerate(cut)}
    made: list[tuple[int, int, int]] = []
    for face in faces[crossed].tolist():
        ring: list[int] = []
        for i, j in zip(face, [*face[1:], face[0]], strict=True):
            ring.append(i)
            if (min(i, j), max(i, j)) in number:
                ring.append(number[min(i, j), max(i, j)])
        for sign in (1, -1):
            part = [i for i in ring if i >= len(values) or side[i] * sign >= 0]
            made += [(part[0], part[k], part[k + 1]) for k in range(1, len(part) - 1)]
    return np.concatenate([values, between]), np.concatenate([faces[~crossed], np.array(made, faces.dtype)])
