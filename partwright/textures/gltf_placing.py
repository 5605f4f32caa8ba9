"""How the materials of a glTF place their pictures: sets of coordinates, transforms, wrapping, strength.

The parser keeps none of it, so the document is handed to it with materials named by their number and with
every set of coordinates.
"""

from __future__ import annotations

import json
import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.gltf_tree import gltf_tree

Floats = NDArray[np.float64]
Wrap = tuple[str, str]  # along u and v: "repeat", "clamp" or "mirror"

REPEATED: Wrap = ("repeat", "repeat")
_WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_SET = "_TEXCOORD_"  # of an attribute that the parser keeps as it is


@dataclass(frozen=True)
class Placing:
    """Of one picture of a material: the set of texture coordinates, what is done to them, (2, 3), measured
    from the picture's upper left, how it goes on beyond its border, and how strongly it bends normals."""

    coordinates: int = 0
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1, 0, 0), (0, 1, 0))
    wrap: Wrap = REPEATED
    strength: float = 1.0

    def of(self, mesh: Any) -> Floats | None:
        """Coordinates (V, 2) of a mesh as parsed, from the picture's lower left; None: it has none."""
        if self.coordinates == 0:
            own = mesh.visual.uv
        else:
            own = mesh.vertex_attributes.get(f"{_SET}{self.coordinates}")
            own = None if own is None else np.column_stack([own[:, 0], 1 - np.asarray(own[:, 1])])
        if own is None:
            return None
        uv = np.array(own, np.float64)
        matrix = np.array(self.matrix, np.float64)
        placed = np.column_stack([uv[:, 0], 1 - uv[:, 1]]) @ matrix[:, :2].T + matrix[:, 2]
        return np.column_stack([placed[:, 0], 1 - placed[:, 1]])


AS_IT_IS = Placing()


@dataclass(frozen=True)
class MaterialPlacing:
    """Of a material's colours and of its normals."""

    colours: Placing = AS_IT_IS
    normals: Placing = AS_IT_IS


def gltf_document(path: Path) -> tuple[bytes, list[MaterialPlacing]] | None:
    """A GLB's or glTF's document whose materials are named by their number, and what these do; None where it
    is of another form than glTF's, which the parser then says."""
    tree = gltf_tree(path)
    try:
        placings = [_of_material(tree, material) for material in tree.get("materials", [])]
        for number, material in enumerate(tree.get("materials", [])):
            material["name"] = str(number)
        for mesh in tree.get("meshes", []):
            for primitive in mesh.get("primitives", []):
                attributes = primitive["attributes"]
                sets = [key for key in attributes if key.startswith("TEXCOORD_") and key != "TEXCOORD_0"]
                attributes |= {f"_{key}": attributes[key] for key in sets}
    except (AttributeError, TypeError, KeyError, ValueError, IndexError):
        return None
    text = json.dumps(tree).encode()
    data = path.read_bytes()
    if data[:4] != b"glTF":
        return text, placings
    text += b" " * (-len(text) % 4)
    (length,) = struct.unpack_from("<I", data, 12)
    chunk = struct.pack("<I", len(text)) + data[16:20] + text + data[20 + length :]
    return data[:8] + struct.pack("<I", 12 + len(chunk)) + chunk, placings


def _of_material(tree: dict[str, Any], material: dict[str, Any]) -> MaterialPlacing:
    rough = material.get("pbrMetallicRoughness", {}).get("baseColorTexture")
    glossy = material.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {})
    colours = glossy.get("diffuseTexture", rough)
    return MaterialPlacing(_of_texture(tree, colours), _of_texture(tree, material.get("normalTexture")))


def _of_texture(tree: dict[str, Any], info: dict[str, Any] | None) -> Placing:
    if info is None:
        return AS_IT_IS
    sampler = tree["textures"][info["index"]].get("sampler")
    said = {} if sampler is None else tree["samplers"][sampler]
    wrap = (_WRAPS[said.get("wrapS", 10497)], _WRAPS[said.get("wrapT", 10497)])
    moved = info.get("extensions", {}).get("KHR_texture_transform", {})
    (x, y), (u, v) = moved.get("offset", (0, 0)), moved.get("scale", (1, 1))
    turn = float(moved.get("rotation", 0))
    cos, sin = math.cos(turn), math.sin(turn)
    matrix = ((u * cos, v * sin, float(x)), (-u * sin, v * cos, float(y)))
    return Placing(moved.get("texCoord", info.get("texCoord", 0)), matrix, wrap, float(info.get("scale", 1)))
