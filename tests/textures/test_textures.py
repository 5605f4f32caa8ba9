"""Colours baked into the parts' own maps: what they are, that edits keep them, and what GLB makes of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.errors import NoColoursError, ParameterError, SettingError, UnreadableFileError
from partwright.export import export
from partwright.fields import Box, Cylinder, Quadric, Sphere, SuperFrustum, Torus, Tube
from partwright.meshing import mesh_assembly, mesh_part
from partwright.shapes.sampling import sample_triangles
from partwright.textures import PartMap, bake, load_colours, part_map
from partwright.textures.coordinates import directions, folded
from partwright.textures.unwrapping import unwrapped

BODY = Part(SuperFrustum((3, 2, 2), 0.4, 0.2), name="body")
ARM = Part(SuperFrustum((0.6, 0.6, 3), 0.9, 0.1, bulge=0.5), (2.2, 0, 0), (0.9, 0.1, 0.3, 0.2), name="arm")
WHOLE = Assembly((BODY, ARM))


def look(points: np.ndarray) -> np.ndarray:
    """Smooth colours of places, 0 to 255."""
    return 127 + 90 * np.sin(points @ np.array([[0.8, 0.2, 0.0], [0.1, 1.0, 0.3], [0.4, 0.0, 0.9]]))


def painted(assembly: Assembly, path: Path, resolution: int = 64) -> Path:
    mesh = mesh_assembly(assembly, resolution)
    for _ in range(2):
        mesh = mesh.subdivide()
    each = np.column_stack([look(mesh.vertices), np.full(len(mesh.vertices), 255)])
    mesh.visual.vertex_colors = np.round(each).astype(np.uint8)
    mesh.export(path)
    return path


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Assembly:
    """The two parts in the maps of their paint."""
    return bake(WHOLE, load_colours(painted(WHOLE, tmp_path_factory.mktemp("painted") / "a.ply")), 64)


def on_surface(mesh: trimesh.Trimesh, count: int = 4000) -> np.ndarray:
    return sample_triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces), count, 1)[0]


@pytest.mark.parametrize(
    "field",
    [
        SuperFrustum((1, 2, 3), 0.4, 0.1, 0.6, 0.7),
        SuperFrustum((2, 2, 3), 1.0, 0.1, 1.4, 0.5, 0.8),
        Box((1, 2, 3)),
        Sphere(2),
        Cylinder(1, 3),
        Tube(2, 0.3, 3),
        Torus(2, 0.5),
    ],
    ids=lambda field: field.kind,
)
def test_no_two_places_of_a_surface_share_a_place_of_the_map(field: object) -> None:
    part = Part(field)  # type: ignore[arg-type]
    mesh = mesh_part(part, 64)
    points = on_surface(mesh, 60_000)
    towards, inner = directions(part.field, points)
    texel = np.floor(np.clip(folded(towards), 0, 1 - 1e-9) * 24) @ [24, 1] + 24 * 24 * inner
    order = np.argsort(texel, kind="stable")
    ends = np.flatnonzero(np.diff(texel[order])) + 1
    side = float(np.ptp(mesh.vertices, axis=0).max())
    spread = [np.ptp(points[group], axis=0).max() for group in np.split(order, ends)]
    assert np.quantile(spread, 0.98) < 0.25 * side
    assert max(spread) < 0.6 * side


def test_what_is_baked_is_what_was_painted(baked: Assembly) -> None:
    mesh = mesh_assembly(WHOLE)
    points = on_surface(mesh)
    owner = np.abs(WHOLE.part_distances(points)).argmin(axis=0)
    for i, part in enumerate(baked.parts):
        mine = points[owner == i]
        local = Similarity(1.0, part.rotation, part.translation).inverse()(mine)
        found = part_map(part).at(part.field, local)
        off = np.abs(found - look(mine))
        assert np.median(off) < 3
        assert np.quantile(off, 0.99) < 16


def test_a_map_goes_where_its_part_goes(tmp_path: Path, baked: Assembly) -> None:
    arm = baked["arm"]
    mesh = mesh_part(Part(arm.field), 32)
    points = on_surface(mesh, 500)
    before = part_map(arm).at(arm.field, points)
    moved = arm.transformed(Similarity(2.0, (0.5, 0.5, 0.5, 0.5), (1, 2, 3)))
    after = part_map(moved).at(moved.field, 2 * points)
    assert np.abs(before - after).max() < 1e-6
    # Longer, and bent the same: a place at the same share of the length has the same colour.
    tall = replace(BODY, field=replace(BODY.field, size=(3, 2, 6), dilation=0.0), metadata=arm.metadata)
    low = replace(tall, field=replace(tall.field, size=(3, 2, 2)))
    place = np.array([[1.5, 0.2, 0.5], [-1.5, -0.3, -0.8]])
    stretched = place * [1, 1, 3]
    assert np.allclose(part_map(low).at(low.field, place), part_map(tall).at(tall.field, stretched))
    baked.save(tmp_path / "a.json")
    assert load_assembly(tmp_path / "a.json") == baked


def test_a_tube_is_another_colour_inside(tmp_path: Path) -> None:
    tube = Assembly((Part(Tube(2, 0.4, 4), (1, 2, 3), (0.8, 0.2, 0.4, 0.1), name="tube"),))
    mesh = mesh_assembly(tube).subdivide().subdivide()
    own = Similarity(1.0, tube["tube"].rotation, tube["tube"].translation).inverse()(mesh.vertices)
    red = np.linalg.norm(own[:, :2], axis=1) < 1.8
    mesh.visual.vertex_colors = np.where(red[:, None], [200, 30, 20, 255], [20, 60, 220, 255]).astype(
        np.uint8
    )
    mesh.export(tmp_path / "tube.ply")
    part = bake(tube, load_colours(tmp_path / "tube.ply"), 32)["tube"]
    texture = part_map(part)
    assert texture.sides == 2
    angle = np.linspace(0, 6, 40)
    for radius, colour in ((2.0, (20, 60, 220)), (1.6, (200, 30, 20))):
        ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.3 * np.sin(3 * angle)], axis=1)
        assert np.abs(texture.at(part.field, ring) - colour).max() < 12


def test_glb_has_the_maps_as_images(tmp_path: Path) -> None:
    cut = Assembly((WHOLE, Part(Cylinder(0.5, 5), name="hole")), "difference", unit="m", up="y")
    baked = bake(cut, load_colours(painted(cut, tmp_path / "a.ply", 80)), 96)
    export(baked, tmp_path / "a.glb")
    scene = trimesh.load_scene(tmp_path / "a.glb")
    assert all(mesh.visual.kind == "texture" for mesh in scene.geometry.values())
    again = load_colours(tmp_path / "a.glb")
    points = on_surface(mesh_assembly(cut), 3000)
    inside = np.linalg.norm(points[:, :2], axis=1) < 0.6  # the hole's wall has what the body has there
    off = np.abs(again.at(points) - look(points))[~inside]
    assert np.median(off) < 4
    assert np.quantile(off, 0.95) < 25


def test_joined_glb_is_the_blended_surface_in_its_colours(tmp_path: Path) -> None:
    """All triangles of the whole, each once, below the node of the part that it belongs to."""
    arm = replace(ARM, blend=0.6, instances=(Similarity(translation=(-4.4, 0, 0)),))
    blended = Assembly((BODY, arm), unit="m", up="y")
    baked = bake(blended, load_colours(painted(blended, tmp_path / "a.ply")), 96)
    whole = mesh_assembly(baked, 64)
    for options in ({}, {"joined": True, "resolution": 64}):
        export(baked, tmp_path / "b.glb", **options)
        scene = trimesh.load_scene(tmp_path / "b.glb")
        assert set(scene.graph.nodes_geometry) == {"body", "arm", "arm/2"}
        mesh = trimesh.util.concatenate([one for one in scene.dump() if isinstance(one, trimesh.Trimesh)])
        again = load_colours(tmp_path / "b.glb")
        points = on_surface(whole)
        off = np.abs(again.at(points) - look(points))
        assert np.median(off) < 5
        same = abs(mesh.area / whole.area - 1) < 1e-4 and abs(mesh.volume / whole.volume - 1) < 1e-4
        assert same == bool(options)
    about = next(e["metadata"] for (_, node), e in scene.graph.transforms.edge_data.items() if node == "body")
    assert about["field"] == BODY.field.to_dict()
    with pytest.raises(SettingError, match="leave out joined or physics"):
        export(baked, tmp_path / "c.glb", joined=True, physics="khr")
    assert not (tmp_path / "c.glb").exists()


def test_cut_triangles_are_the_same_surface() -> None:
    part = Part(SuperFrustum((1, 2, 3), 0.5, 0.1, 0.7, 0.4, 0.5))
    mesh = mesh_part(part, 24)
    rng = np.random.default_rng(0)
    texture = PartMap(rng.integers(0, 256, (8, 16, 3)).astype(np.uint8))
    result, uv, image = unwrapped(mesh, part.field, texture)
    assert result.area == pytest.approx(mesh.area, rel=1e-9)
    assert result.volume == pytest.approx(mesh.volume, rel=1e-9)
    assert image.size == (16, 8)
    assert uv.min() > 0
    assert uv.max() < 1
    spans = np.ptp(uv[result.faces], axis=1)
    assert spans.max() < 0.51  # no triangle reaches over a fold


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_images_and_factors_of_materials(tmp_path: Path, suffix: str) -> None:
    image = np.zeros((4, 8, 3), np.uint8)
    image[:, :4], image[:, 4:] = (200, 40, 30), (10, 90, 250)
    square = trimesh.Trimesh(
        [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]], process=False
    )
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    picture = Image.fromarray(image)
    material = (
        trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
        if suffix == ".glb"
        else trimesh.visual.material.SimpleMaterial(image=picture)
    )
    square.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    square.export(tmp_path / f"a{suffix}")
    found = load_colours(tmp_path / f"a{suffix}").at(np.array([[0.5, 0.5, 0.3], [1.5, 0.5, -0.2]]))
    assert np.abs(found - [(200, 40, 30), (10, 90, 250)]).max() < 2


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj"])
@pytest.mark.parametrize("harm", ["gone", "damaged", "huge"])
def test_pictures_that_are_missing_damaged_or_huge_are_named(
    tmp_path: Path, suffix: str, harm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = Image.fromarray(np.full((8, 8, 3), 90, np.uint8))
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
    material = (
        trimesh.visual.material.SimpleMaterial(image=picture)
        if suffix == ".obj"
        else trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
    )
    square.visual = trimesh.visual.TextureVisuals(uv=square.vertices[:, :2], material=material)
    path = tmp_path / f"a{suffix}"
    if suffix == ".gltf":  # pictures beside it
        trimesh.Scene(square).export(path)
        tree = json.loads(path.read_text())
        picture.save(tmp_path / "p.png")
        tree["images"][0] = {"uri": "p.png"}
        path.write_text(json.dumps(tree))
    else:
        square.export(path)
    assert load_colours(path)
    if harm == "huge":
        monkeypatch.setattr("partwright.textures.images.LARGEST", 10)
    elif suffix == ".glb":
        data = path.read_bytes()
        path.write_bytes(data.replace(b"\x89PNG", b"\x00\x00\x00\x00"))
    else:
        (file,) = tmp_path.glob("*.png")
        if harm == "gone":
            file.unlink()
        else:
            file.write_bytes(b"no picture")
    with pytest.raises(UnreadableFileError, match="8 x 8 pixels" if harm == "huge" else "png|picture"):
        load_colours(path)


def test_quadrics_get_one_colour_and_copies_share_a_map(tmp_path: Path) -> None:
    ball = Assembly((Part(Quadric.sphere(1.0)), Part(Quadric.plane((0, 0, 1), 0.5))), "intersection")
    legs = Part(Box((0.4, 0.4, 2)), (3, 0, 0), name="leg", instances=(Similarity(translation=(2, 0, 0)),))
    whole = Assembly((ball, legs))
    baked = bake(whole, load_colours(painted(whole, tmp_path / "a.ply")), 16)
    assert all(part.metadata["colour"].startswith("#") for part in baked.parts[:2])
    assert baked["leg"].instances == legs.instances
    assert part_map(baked["leg"]).image.std() > 1


def test_what_is_no_map_and_what_has_no_colours_is_said(tmp_path: Path) -> None:
    for text in ("", "data:image/png;base64,AAAA", "data:image/png;base64,%", "https://example.com/a.png"):
        with pytest.raises(ParameterError, match="map"):
            PartMap.read(text)
    with pytest.raises(ParameterError, match="expected"):
        PartMap(np.zeros((3, 4, 3), np.uint8))
    mesh = mesh_assembly(WHOLE, 32)
    mesh.export(tmp_path / "plain.stl")
    with pytest.raises(NoColoursError, match=r"plain\.stl"):
        load_colours(tmp_path / "plain.stl")
    (tmp_path / "cut.glb").write_bytes(b"glTF")
    with pytest.raises(UnreadableFileError):
        load_colours(tmp_path / "cut.glb")
    with pytest.raises(NoColoursError):
        load_colours(tmp_path / "a.3mf")
    colours = load_colours(painted(WHOLE, tmp_path / "a.ply", 32))
    with pytest.raises(SettingError, match="size"):
        bake(WHOLE, colours, 0)
