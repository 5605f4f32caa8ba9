"""Normal maps of parts: detail that the smooth part lacks, where it pays, in every format that holds one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from partwright.assembly import Assembly, Part, Similarity
from partwright.export import export
from partwright.fields import Box, Sphere, SuperFrustum, Tube
from partwright.meshing import mesh_assembly, mesh_part
from partwright.shapes.corner_normals import corner_normals
from partwright.textures import Colours, bake, load_colours, part_map
from partwright.textures.coordinates import directions, folded, frames
from partwright.textures.likeness import likeness, map_normals, without_relief
from partwright.textures.maps import RELIEF

POSE = Similarity(1.0, (0.8, 0.2, 0.4, 0.4), (1, 2, 3))
BALL = Assembly((Part(Sphere(1.0), POSE.translation, POSE.rotation, name="ball"),), unit="m", up="y")


def waves(points: np.ndarray) -> np.ndarray:
    """Normals of a ball with waves, at points of the plain one."""
    away = points - np.array(POSE.translation)
    bent = away + 0.35 * np.sin(5 * away[:, [1, 2, 0]])
    return bent / np.linalg.norm(bent, axis=1, keepdims=True)


def wavy(path: Path) -> Path:
    """A plain ball whose vertices have other normals, and a colour."""
    mesh = trimesh.creation.icosphere(6, 1.0)
    vertices = np.asarray(mesh.vertices) + np.array(POSE.translation)
    colours = np.tile(np.array([200, 90, 40, 255], np.uint8), (len(vertices), 1))
    whole = trimesh.Trimesh(
        vertices, mesh.faces, vertex_normals=waves(vertices), vertex_colors=colours, process=False
    )
    path.write_bytes(trimesh.exchange.gltf.export_glb(trimesh.Scene(whole), include_normals=True))
    return path


@pytest.fixture(scope="module")
def colours(tmp_path_factory: pytest.TempPathFactory) -> Colours:
    return load_colours(wavy(tmp_path_factory.mktemp("wavy") / "a.glb"))


@pytest.fixture(scope="module")
def baked(colours: Colours) -> Assembly:
    return bake(BALL, colours, 96)


@pytest.mark.parametrize(
    "field",
    [SuperFrustum((1, 2, 3), 0.5, 0.1, 0.7, 0.4), Sphere(1), Box((1, 2, 3)), Tube(2, 0.4, 3)],
    ids=lambda field: field.kind,
)
def test_frames_follow_the_map(field: object) -> None:
    """A step along the tangent is one to the right on the map, one along the other is one up."""
    part = Part(field)  # type: ignore[arg-type]
    mesh = mesh_part(part, 48)
    corners = corner_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    points, normals = np.asarray(mesh.triangles_center), corners.mean(axis=1).astype(float)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    across, turned = frames(part.field, points, normals)
    assert np.allclose((across * normals).sum(axis=1), 0, atol=1e-9)
    assert np.allclose(np.linalg.norm(across, axis=1), 1)
    towards, inner = directions(part.field, points)
    for side in (inner, ~inner):  # each is one way round: a bent part's map is mirrored
        assert not side.any() or abs(turned[side].mean()) > 0.7
    sign = np.where(towards < 0, -1.0, 1.0)
    start = folded(towards, sign)
    step = folded(directions(part.field, points + 1e-4 * across)[0], sign) - start
    assert (step[:, 0] > 0).mean() > 0.99
    assert np.median(np.abs(step[:, 1]) / step[:, 0]) < 1e-2


def test_a_balls_known_normals_come_back(colours: Colours, baked: Assembly) -> None:
    mesh = mesh_assembly(BALL)
    points, smooth = np.asarray(mesh.vertices), np.asarray(mesh.vertices) - np.array(POSE.translation)
    smooth = smooth / np.linalg.norm(smooth, axis=1, keepdims=True)
    wanted = waves(points)
    before = np.degrees(np.arccos(np.clip((smooth * wanted).sum(axis=1), -1, 1)))
    after = np.degrees(np.arccos(np.clip((map_normals(baked, points, smooth) * wanted).sum(axis=1), -1, 1)))
    assert np.median(before) > 10
    assert np.median(after) < 1.5
    assert np.quantile(after, 0.95) < 5
    plain, bent = likeness([without_relief(baked), baked], colours, lit=True)
    assert bent[1] > plain[1] + 8
    moved = baked["ball"].transformed(Similarity(2.0, (0.5, 0.5, 0.5, 0.5), (1, 2, 3)))
    assert moved.metadata[RELIEF] == baked["ball"].metadata[RELIEF]


def test_smooth_inputs_get_no_normal_map(tmp_path: Path) -> None:
    mesh = mesh_assembly(BALL, 96)
    mesh.visual.vertex_colors = np.tile(np.array([200, 90, 40, 255], np.uint8), (len(mesh.vertices), 1))
    mesh.export(tmp_path / "a.ply")
    baked = bake(BALL, load_colours(tmp_path / "a.ply"), 32)
    assert part_map(baked["ball"]) is not None
    assert part_map(baked["ball"], RELIEF) is None
    export(baked, tmp_path / "b.glb")
    material = next(iter(trimesh.load_scene(tmp_path / "b.glb").geometry.values())).visual.material
    assert material.normalTexture is None


@pytest.mark.parametrize("options", [{}, {"joined": True}])
def test_glb_is_read_back_with_the_normals(tmp_path: Path, baked: Assembly, options: dict) -> None:
    export(baked, tmp_path / "b.glb", **options)
    again = load_colours(tmp_path / "b.glb")
    assert len(again.reliefs) == 1
    rng = np.random.default_rng(0)
    points = rng.normal(size=(4000, 3))
    points = points / np.linalg.norm(points, axis=1, keepdims=True) + np.array(POSE.translation)
    found = again.normals_on_faces(*again.nearest(points))
    off = np.degrees(np.arccos(np.clip((found * waves(points)).sum(axis=1), -1, 1)))
    assert np.median(off) < 3
    assert np.quantile(off, 0.9) < 8
    scene = trimesh.load_scene(tmp_path / "b.glb")
    (mesh,) = scene.geometry.values()
    assert "vertex_normals" in mesh._cache
    tree = (tmp_path / "b.glb").read_bytes()
    assert b'"TANGENT"' in tree
    assert b'"_TANGENT"' not in tree
    assert b"base64" not in tree


def test_a_normal_map_of_the_input_is_read(tmp_path: Path) -> None:
    square = trimesh.Trimesh(
        [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], [[0, 1, 2], [0, 2, 3]], process=False
    )
    relief = np.full((8, 8, 3), (204, 128, 230), np.uint8)  # leaning to the right
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.new("RGB", (8, 8), "white"), normalTexture=Image.fromarray(relief)
    )
    square.visual = trimesh.visual.TextureVisuals(uv=square.vertices[:, :2] / 2, material=material)
    square.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1]))
    square.export(tmp_path / "a.glb")
    colours = load_colours(tmp_path / "a.glb")
    found = colours.normals_on_faces(np.array([0, 1]), np.full((2, 3), 1 / 3))
    wanted = np.array([0, 204 / 127.5 - 1, 230 / 127.5 - 1])  # the image's right is +y now
    assert np.allclose(found, wanted / np.linalg.norm(wanted), atol=0.01)


def test_usd_and_blenders_script_have_them(tmp_path: Path, baked: Assembly) -> None:
    baked = replace(baked, name="ball")
    export(baked, tmp_path / "b.blender.py")
    text = (tmp_path / "b.blender.py").read_text("ascii")
    compile(text, "b.blender.py", "exec")
    assert "RELIEFS = {'ball': 1}" in text
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdShade, UsdValidation

    export(baked, tmp_path / "b.usda")
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["b_ball.png", "b_ball_normals.png"]
    stage = Usd.Stage.Open(str(tmp_path / "b.usda"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert not errors, [error.GetMessage() for error in errors]
    (prim,) = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    mesh = UsdGeom.Mesh(prim)
    points, normals = np.array(mesh.GetPointsAttr().Get()), np.array(mesh.GetNormalsAttr().Get())
    assert (np.einsum("nd,nd->n", points, normals) > 0.9 * np.linalg.norm(points, axis=1)).mean() > 0.999
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    surface = material.ComputeSurfaceSource()[0]
    texture = UsdShade.Shader(surface.GetInput("normal").GetConnectedSource()[0].GetPrim())
    assert texture.GetInput("sourceColorSpace").Get() == "raw"
    assert texture.GetInput("file").Get().path == "./b_ball_normals.png"
