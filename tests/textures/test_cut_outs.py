"""What the alpha of a glTF material cuts out has no colour, and is seen through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from partwright.assembly import Assembly, Part
from partwright.fields import Box
from partwright.render.raycast import Scene
from partwright.textures import bake, load_colours, part_map
from partwright.textures.cut_outs import first_shown
from partwright.textures.likeness import around, seen

RED, GREEN, BLUE = (200, 0, 0), (0, 200, 0), (0, 0, 200)


def box(size: float, left: tuple[int, ...], right: tuple[int, ...], **material: object) -> trimesh.Trimesh:
    """A cube of these colours, RGB or RGBA, where x is below and above 0."""
    mesh = trimesh.creation.box((size,) * 3)
    mesh = mesh.subdivide_to_size(size / 4)
    picture = Image.fromarray(np.array([[left, right]], np.uint8).repeat(32, 0).repeat(32, 1))
    uv = 0.9 * mesh.vertices[:, :2] / size + 0.5  # the picture goes on beyond its border
    look = trimesh.visual.material.PBRMaterial(baseColorTexture=picture, metallicFactor=0.0, **material)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=look)
    return mesh


def saved(folder: Path, *meshes: trimesh.Trimesh) -> Path:
    trimesh.Scene(list(meshes)).export(folder / "a.glb")
    return folder / "a.glb"


@pytest.mark.parametrize(
    ("material", "wanted"),
    [
        ({"alphaMode": "MASK", "alphaCutoff": 0.3}, GREEN),
        ({"alphaMode": "MASK", "alphaCutoff": 0.1}, RED),
        ({"alphaMode": "MASK"}, GREEN),
        ({"alphaMode": "BLEND"}, RED),
        ({"alphaMode": "OPAQUE"}, RED),
    ],
)
def test_what_is_cut_out_colours_nothing(
    tmp_path: Path, material: dict[str, object], wanted: tuple[int, int, int]
) -> None:
    path = saved(tmp_path, box(1.0, (*RED, 50), (*GREEN, 255), **material))
    baked = bake(Assembly((Part(Box((1, 1, 1)), name="a"),)), load_colours(path), size=16, optimise=False)
    texture = part_map(baked["a"])
    assert texture is not None
    left, right = texture.at(baked["a"].field, np.array([(-0.25, 0.5, 0.1), (0.25, 0.5, 0.1)]))
    assert np.abs(left - wanted).max() < 6
    assert np.abs(right - GREEN).max() < 6


@pytest.mark.parametrize("clear", [(*RED, 0), (*RED, 255)])
def test_rays_go_through_what_is_cut_out(tmp_path: Path, clear: tuple[int, ...]) -> None:
    """The outer cube is not there, by its picture or by its factor; the inner one is."""
    factor = [255, 255, 255, 255 if clear[3] == 0 else 0]
    outer = box(2.0, clear, clear, alphaMode="BLEND", baseColorFactor=factor)
    colours = load_colours(saved(tmp_path, outer, box(1.0, BLUE, GREEN)))
    scene = Scene(colours.vertices, colours.faces)
    origins = np.array([(5.0, 0.1, 0.2), (-5.0, 0.1, 0.2), (5.0, 0.8, 0.2)])
    rays = np.array([(-2.0, 0, 0), (1.0, 0, 0), (-1.0, 0, 0)])
    face, distance, weights = first_shown(scene, colours, origins, rays)
    assert distance == pytest.approx([2.25, 4.5, np.inf], abs=1e-4)
    assert face[2] == -1
    assert np.abs(colours.on_faces(face[:2], weights[:2]) - (GREEN, BLUE)).max() < 3
    view = around(colours.vertices, "y")[0]
    alone, both = seen(scene, view, colours)[0], seen(scene, view)[0]
    assert 0.05 * len(both) < len(alone) < 0.5 * len(both)
