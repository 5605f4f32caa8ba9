"""Pictures of glTF materials lie where the file says: transforms, sets of coordinates, wrapping, strength."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from partwright.errors import UnreadableFileError
from partwright.textures import load_colours

QUADRANTS = np.array([[(200, 0, 0), (0, 200, 0)], [(0, 0, 200), (200, 200, 0)]], np.uint8)
UPPER_LEFT, UPPER_RIGHT, LOWER_LEFT, LOWER_RIGHT = QUADRANTS.reshape(4, 3)


def square(path: Path, uv: np.ndarray, change: Any) -> Path:
    """A unit square, of whose document `change` makes another; `uv` (4, 2) from the picture's upper left."""
    picture = Image.fromarray(np.kron(QUADRANTS, np.ones((32, 32, 1), np.uint8)))
    relief = Image.fromarray(np.full((8, 8, 3), (204, 128, 230), np.uint8))
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=picture, normalTexture=relief)
    mesh = trimesh.Trimesh(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        visual=trimesh.visual.TextureVisuals(uv=np.column_stack([uv[:, 0], 1 - uv[:, 1]]), material=material),
        vertex_attributes={"_OTHER": np.full((4, 2), 0.25, np.float32)},
        process=False,
    )
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh))
    for name, data in files.items():
        (path.parent / name).write_bytes(data)
    tree = json.loads(files["model.gltf"])
    change(tree)
    path.write_text(json.dumps(tree))
    return path


def colour_info(tree: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    return found


UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)  # upright


def test_a_transform_is_applied_as_the_extension_says(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:  # its own example: the lower left quadrant, turned clockwise
        moved = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [0.5, 0.5]}
        colour_info(tree)["extensions"] = {"KHR_texture_transform": moved}

    found = load_colours(square(tmp_path / "a.gltf", UV, change))
    places = np.array([[x, y, 0] for x in (0.2, 0.8) for y in (0.2, 0.8)])
    assert np.abs(found.at(places) - LOWER_LEFT).max() < 2
    corners = found.uv[0]  # of the square's lower left, lower right and upper right, from the lower left
    assert np.allclose(corners, [(0.5, 0), (0.5, 0.5), (0, 0.5)], atol=1e-6)


def test_the_set_of_coordinates_that_is_named_is_used(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        attributes = tree["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_1"] = attributes.pop("_OTHER")
        colour_info(tree)["texCoord"] = 1

    found = load_colours(square(tmp_path / "a.gltf", UV, change))
    assert np.abs(found.at(np.array([[0.8, 0.2, 0.0]])) - UPPER_LEFT).max() < 2
    assert np.ptp(found.relief_uv[0], axis=0).min() == pytest.approx(1)  # normals keep the first


@pytest.mark.parametrize(
    ("wrap", "wanted"), [(10497, UPPER_LEFT), (33071, UPPER_RIGHT), (33648, UPPER_RIGHT)]
)
def test_beyond_its_border_a_picture_goes_on_as_the_sampler_says(
    tmp_path: Path, wrap: int, wanted: np.ndarray
) -> None:
    def change(tree: dict[str, Any]) -> None:
        tree["samplers"] = [{"wrapS": wrap}]
        for texture in tree["textures"]:
            texture["sampler"] = 0

    path = square(tmp_path / "a.gltf", UV * (2, 1), change)
    place = np.array([[0.6, 0.8, 0.0]])  # u is 1.2
    assert np.abs(load_colours(path).at(place) - wanted).max() < 2


@pytest.mark.parametrize("strength", [0.0, 0.5])
def test_a_normal_maps_strength(tmp_path: Path, strength: float) -> None:
    def change(tree: dict[str, Any]) -> None:
        tree["materials"][0]["normalTexture"]["scale"] = strength

    found = load_colours(square(tmp_path / "a.gltf", UV, change))
    normal = found.normals_on_faces(np.array([0]), np.full((1, 3), 1 / 3))[0]
    assert normal[0] / normal[2] == pytest.approx(strength * (204 / 127.5 - 1) / (230 / 127.5 - 1), abs=1e-3)


def test_a_picture_of_a_format_that_is_not_read_is_named(tmp_path: Path) -> None:
    def change(tree: dict[str, Any]) -> None:
        (tmp_path / "bark.ktx2").write_bytes(b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80))
        tree["images"].append({"uri": "bark.ktx2"})
        texture = tree["textures"][colour_info(tree)["index"]]
        texture.pop("source")
        texture["extensions"] = {"KHR_texture_basisu": {"source": len(tree["images"]) - 1}}

    with pytest.raises(UnreadableFileError, match=r"bark\.ktx2"):
        load_colours(square(tmp_path / "a.gltf", UV, change))
