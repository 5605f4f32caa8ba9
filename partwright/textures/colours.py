"""The colours of a file: those of its vertices and faces, of its materials, and their images."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import NoColoursError
from partwright.rows import crosses, dots, sums, units
from partwright.shapes.corner_normals import corner_normals
from partwright.shapes.distance import MeshDistance
from partwright.shapes.loading import READ_BY_TRIMESH, load_scene
from partwright.textures.cut_outs import cut_out
from partwright.textures.gltf_placing import MaterialPlacing, Placing, Wrap, gltf_document
from partwright.textures.images import check_images
from partwright.textures.texels import nearest_known

Floats = NDArray[np.float64]

_PLAIN = (204, 204, 204)  # of pieces without a colour beside others that have some


@dataclass(frozen=True)
class Picture:
    """values (h, w, 3), or 4 with how opaque it is, and how it goes on beyond its border."""

    values: NDArray[np.float32]
    wrap: Wrap

    def at(self, uv: Floats) -> Floats:
        """Bilinear; uv (N, 2) from its lower left."""
        height, width = self.values.shape[:2]
        x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
        x0, y0 = np.floor(x), np.floor(y)
        fx, fy = (x - x0)[:, None], (y - y0)[:, None]
        left, right = (_texel(x0 + d, width, self.wrap[0]) for d in (0, 1))
        top, bottom = (_texel(y0 + d, height, self.wrap[1]) for d in (0, 1))
        upper = (1 - fx) * self.values[top, left] + fx * self.values[top, right]
        lower = (1 - fx) * self.values[bottom, left] + fx * self.values[bottom, right]
        return np.asarray((1 - fy) * upper + fy * lower)


@dataclass(frozen=True)
class Colours:
    """A surface with colours: vertices (V, 3) and faces (F, 3) in the file's own units and place.

    corners (F, 3, 3): colours of the faces' corners, 0 to 1, linear light, which multiply those of the
    image. image (F,): which of `images` (h, w, 3 float, linear light) is on a face, -1 for none; uv
    (F, 3, 2): where, from its lower left.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    corners: NDArray[np.float32]
    image: NDArray[np.int64]
    uv: NDArray[np.float32]
    images: tuple[Picture, ...]
    normals: NDArray[np.float32]
    """(F, 3, 3): of the faces' corners, those of the file or else smooth ones between creases."""
    relief: NDArray[np.int64]
    """(F,): which of `reliefs` bends the normals of a face, -1 for none."""
    relief_uv: NDArray[np.float32]
    """(F, 3, 2): where on that, as `uv`."""
    reliefs: tuple[Picture, ...]
    """Normal maps (h, w, 3): across, up and away from the face, -1 to 1."""
    opacity: NDArray[np.float32]
    """(F, 3): of the faces' corners, 0 to 1, which multiplies that of the image."""
    least: NDArray[np.float32]
    """(F,): what is less opaque is not shown; 0 of faces that are shown whole."""

    @cached_property
    def _frame(self) -> tuple[Floats, float]:
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        return (low + high) / 2, 1.8 / max(float((high - low).max()), 1e-300)

    @cached_property
    def _surface(self) -> MeshDistance:
        centre, scale = self._frame
        return MeshDistance((self.vertices - centre) * scale, self.faces, self.faces, closed=False)

    def at(self, points: NDArray[np.floating]) -> Floats:
        """Colours (N, 3), sRGB, 0 to 255, at the places of the surface nearest to points (N, 3)."""
        return self.on_faces(*self.nearest(points))

    def nearest(self, points: NDArray[np.floating]) -> tuple[NDArray[np.int64], Floats]:
        """The faces (N,) nearest to points (N, 3), and barycentric weights (N, 3) there."""
        centre, scale = self._frame
        local = (np.asarray(points, np.float64) - centre) * scale
        face, _ = self._surface.nearest(local)
        corners = ((self.vertices - centre) * scale)[self.faces[face]]
        return face.astype(np.int64), barycentric(corners, local)

    def on_faces(self, face: NDArray[np.int64], weights: Floats) -> Floats:
        """Colours (N, 3), sRGB, 0 to 255, on faces (N,) at barycentric weights (N, 3)."""
        result = np.einsum("nc,ncd->nd", weights, self.corners[face].astype(np.float64))
        uv = np.einsum("nc,ncd->nd", weights, self.uv[face].astype(np.float64))
        for i, image in enumerate(self.images):
            mine = np.flatnonzero(self.image[face] == i)
            result[mine] *= image.at(uv[mine])[:, :3]
        return 255 * to_srgb(result)

    def shown(self, face: NDArray[np.int64], weights: Floats) -> NDArray[np.bool_]:
        """Whether there is something to be seen (N,) on faces (N,) at barycentric weights (N, 3)."""
        result = np.ones(len(face), bool)
        cut = np.flatnonzero(self.least[face] > 0)
        if not len(cut):
            return result
        face, weights = face[cut], weights[cut]
        opaque = np.einsum("nc,nc->n", weights, self.opacity[face].astype(np.float64))
        uv = np.einsum("nc,ncd->nd", weights, self.uv[face].astype(np.float64))
        for i, image in enumerate(self.images):
            mine = np.flatnonzero(self.image[face] == i)
            if image.values.shape[2] == 4:
                opaque[mine] *= image.at(uv[mine])[:, 3]
        result[cut] = opaque >= self.least[face]
        return result

    def normals_on_faces(self, face: NDArray[np.int64], weights: Floats) -> Floats:
        """Unit normals (N, 3) on faces (N,) at barycentric weights (N, 3), with what normal maps say."""
        result = units(np.einsum("nc,ncd->nd", weights, self.normals[face].astype(np.float64)))
        uv = np.einsum("nc,ncd->nd", weights, self.relief_uv[face].astype(np.float64))
        for i, image in enumerate(self.reliefs):
            mine = np.flatnonzero(self.relief[face] == i)
            bent = image.at(uv[mine])
            across, up = self._tangents(face[mine], result[mine])
            result[mine] = units(bent[:, :1] * across + bent[:, 1:2] * up + bent[:, 2:] * result[mine])
        return result

    def _tangents(self, face: NDArray[np.int64], normals: Floats) -> tuple[Floats, Floats]:
        """Directions (N, 3) across and up an image on faces (N,), at right angles to normals (N, 3)."""
        corners, uv = self.vertices[self.faces[face]], self.relief_uv[face].astype(np.float64)
        (e, f), (g, h) = ((one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]) for one in (corners, uv))
        turned = np.where(g[:, 0] * h[:, 1] - h[:, 0] * g[:, 1] < 0, -1.0, 1.0)[:, None]
        across = turned * (h[:, 1:] * e - g[:, 1:] * f)
        across = units(across - dots(across, normals)[:, None] * normals)
        return across, turned * crosses(normals, across)


def load_colours(path: str | Path) -> Colours:
    """The colours of a mesh file: of glTF and OBJ with materials and their images, of PLY and OFF those of
    vertices and faces.

    Raises:
        NoColoursError: it has none.
        UnreadableFileError, UnsupportedFormatError: as `load_shape`, or a picture is missing, damaged or
            huge.
    """
    path = Path(path)
    if path.suffix.lower() not in READ_BY_TRIMESH:
        raise NoColoursError(f"{path.name}: colours are read from {', '.join(READ_BY_TRIMESH)}")
    check_images(path)
    is_gltf = path.suffix.lower() in (".glb", ".gltf")
    document, placings = (is_gltf and gltf_document(path)) or (None, [])
    scene = load_scene(path, path.suffix.lower(), colours=True, document=document)
    images: list[Picture] = []
    reliefs: list[Picture] = []
    pieces: list[tuple[Any, ...]] = []
    found, total = False, 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not len(getattr(mesh, "faces", ())):
            continue
        placing = _placing(mesh, placings)
        corners, uv, image = _look(mesh, is_gltf, placing.colours)
        limit, share = cut_out(mesh) if is_gltf else (0.0, np.ones(3))
        found = found or corners is not None or image is not None
        index = -1
        if image is not None:
            index = len(images)
            images.append(image)
        count = len(mesh.faces)
        plain = np.broadcast_to(to_linear(np.array(_PLAIN) / 255), (count, 3, 3))
        white = np.ones((count, 3, 3))
        colour = corners if corners is not None else white if image is not None else plain
        vertices = np.asarray(mesh.vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        relief, relief_uv, bends = _relief(mesh, placing.normals), uv, -1
        if relief is not None:
            bends, relief_uv = len(reliefs), relief[1]
            reliefs.append(relief[0])
        normals = _normals(mesh, np.asarray(matrix, np.float64))
        own = (vertices, np.asarray(mesh.faces) + total, colour, np.full(count, index), uv)
        opaque = np.broadcast_to(share, (count, 3)), np.full(count, limit)
        pieces.append((*own, normals, np.full(count, bends), relief_uv, *opaque))
        total += len(vertices)
    if not found:
        raise NoColoursError(f"{path.name}: has no colours: neither of vertices or faces nor of materials")
    places, triangles, shades, which, where, normals, bend, bend_at, opacity, least = (
        np.concatenate(one) for one in zip(*pieces, strict=True)
    )
    return Colours(
        places.astype(np.float64),
        triangles.astype(np.int64),
        shades.astype(np.float32),
        which.astype(np.int64),
        where.astype(np.float32),
        tuple(images),
        normals.astype(np.float32),
        bend.astype(np.int64),
        bend_at.astype(np.float32),
        tuple(reliefs),
        opacity.astype(np.float32),
        least.astype(np.float32),
    )


def to_linear(srgb: NDArray[Any]) -> Floats:
    """Linear light of sRGB, both 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0) + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: NDArray[Any]) -> Floats:
    """The inverse of `to_linear`; what is out of range is cut."""
    cut = np.clip(linear, 0, 1)
    return np.where(cut <= 0.0031308, 12.92 * cut, 1.055 * cut ** (1 / 2.4) - 0.055)


def _placing(mesh: Any, placings: list[MaterialPlacing]) -> MaterialPlacing:
    """What its material does, if it has one."""
    name = str(getattr(getattr(mesh.visual, "material", None), "name", ""))
    return placings[int(name)] if name.isdigit() and int(name) < len(placings) else MaterialPlacing()


def _look(mesh: Any, is_gltf: bool, placing: Placing) -> tuple[Floats | None, Floats, Picture | None]:
    """Colours of corners (F, 3, 3), linear light, or None; uv (F, 3, 2); the image, or None."""
    faces = np.asarray(mesh.faces)
    uv = np.zeros((len(faces), 3, 2))
    visual = mesh.visual
    if visual.kind == "texture":
        material = visual.material
        factor = getattr(material, "baseColorFactor", None)
        if factor is None:
            factor = getattr(material, "diffuse", None)
        each = visual.vertex_attributes.get("color")
        image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        colour = None
        if factor is not None:
            # glTF's factors are linear; those of OBJ are what the screen shows.
            values = np.asarray(factor, np.float64)[:3]
            values = values / 255 if np.asarray(factor).dtype.kind in "iu" or values.max() > 1 else values
            linear = values if is_gltf else to_linear(values)
            colour = np.broadcast_to(linear, (len(faces), 3, 3))
        if each is not None and is_gltf:  # which multiplies the material's
            shares = np.asarray(each, np.float64)[:, :3] / (255 if np.asarray(each).dtype.kind in "iu" else 1)
            colour = shares[faces] * (1.0 if colour is None else colour)
        own = placing.of(mesh)
        if image is None or own is None:
            return colour, uv, None
        least = cut_out(mesh)[0] if is_gltf else 0.0
        pixels = np.asarray(image.convert("RGBA" if least > 0 else "RGB")) / 255
        pixels[..., :3] = to_linear(pixels[..., :3])
        if least > 0:  # the colours of what is cut out would mix with those beside it
            pixels[..., :3] = nearest_known(pixels[..., :3], pixels[..., 3] >= least)
        if not is_gltf:
            colour = None  # an image takes the place of the diffuse colour
        return colour, own[faces], Picture(pixels.astype(np.float32), placing.wrap)
    if visual.kind == "vertex":
        each = np.asarray(visual.vertex_colors)[:, :3][faces] / 255
    elif visual.kind == "face":
        each = np.broadcast_to(np.asarray(visual.face_colors)[:, None, :3] / 255, (len(faces), 3, 3))
    else:
        return None, uv, None
    return (each if is_gltf else to_linear(each)), uv, None


def _relief(mesh: Any, placing: Placing) -> tuple[Picture, Floats] | None:
    """The normal map of its material, and where its faces (F, 3, 2) lie on that."""
    image = getattr(getattr(mesh.visual, "material", None), "normalTexture", None)
    uv = None if image is None else placing.of(mesh)
    if image is None or uv is None:
        return None
    values = (np.asarray(image.convert("RGB")) / 127.5 - 1) * (placing.strength, placing.strength, 1)
    return Picture(values.astype(np.float32), placing.wrap), uv[mesh.faces]


def _normals(mesh: Any, matrix: Floats) -> Floats:
    """Of the faces' corners (F, 3, 3), placed: the file's own, where it has usable ones."""
    faces, vertices = np.asarray(mesh.faces), np.asarray(mesh.vertices, np.float64)
    own = np.asarray(mesh.vertex_normals, np.float64) if "vertex_normals" in mesh._cache else None
    if own is not None and own.shape == vertices.shape and (np.linalg.norm(own, axis=1) > 0.5).all():
        corners = own[faces]
    else:
        places, number = np.unique(vertices, axis=0, return_inverse=True)  # files part them at seams
        corners = corner_normals(places, number.reshape(-1)[faces]).astype(np.float64)
    turn = np.linalg.pinv(matrix[:3, :3]).T
    return units((corners @ turn.T).reshape(-1, 3)).reshape(-1, 3, 3)


def _texel(index: Floats, count: int, wrap: str) -> NDArray[np.int64]:
    """Which of `count` texels in a row is at each index, within the row or not."""
    if wrap == "clamp":
        return np.clip(index, 0, count - 1).astype(np.int64)
    if wrap == "mirror":
        there = np.mod(index, 2 * count).astype(np.int64)
        return np.minimum(there, 2 * count - 1 - there)
    return np.mod(index, count).astype(np.int64)


def barycentric(corners: Floats, points: Floats) -> Floats:
    """Weights (N, 3) of the place on each triangle (N, 3, 3) that is nearest to its point (N, 3), about:
    of points off the triangle they are cut to its edges."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (np.einsum("nd,nd->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
    wu, wv = np.einsum("nd,nd->n", w, u), np.einsum("nd,nd->n", w, v)
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    second, third = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    weights = np.clip(np.stack([1 - second - third, second, third], axis=1), 0, 1)
    return np.asarray(weights / np.maximum(sums(weights)[:, None], 1e-12))
