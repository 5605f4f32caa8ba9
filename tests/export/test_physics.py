"""Colliders in GLB, OBJ, USD: what glTF's extensions, Unreal's and Godot's names and UsdPhysics ask for."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import trimesh

from partwright.approximation.nearest import nearest_solid
from partwright.approximation.round_cone import RoundCone
from partwright.assembly import Assembly, Part, Similarity
from partwright.cli.main import main
from partwright.errors import ParameterError, SettingError
from partwright.export import export
from partwright.export.axes import to_gltf
from partwright.fields import Box, Capsule, Cylinder, Frustum, Sphere, SuperFrustum
from partwright.meshing.mass import mass_properties
from tests.export.robotics import natives
from tests.export.test_gltf_validator import validated

NUMBER, INDEX = {"type": "number"}, {"type": "integer", "minimum": 0}
POSITIVE, ZERO_UP = {"type": "number", "exclusiveMinimum": 0}, {"type": "number", "minimum": 0}


def exactly(required: dict[str, Any], **optional: Any) -> dict[str, Any]:
    """A JSON object of these properties and no others."""
    return {
        "type": "object",
        "properties": required | optional,
        "required": list(required),
        "additionalProperties": False,
    }


def several(item: dict[str, Any], count: int) -> dict[str, Any]:
    return {"type": "array", "items": item, "minItems": count, "maxItems": count}


# What the two extensions say of what is written here, in JSON Schema; nothing else is allowed.
ROUND = exactly({"height": POSITIVE, "radiusBottom": ZERO_UP, "radiusTop": ZERO_UP})
SHAPE = {
    "oneOf": [
        exactly({"type": {"const": "box"}, "box": exactly({"size": several(POSITIVE, 3)})}),
        exactly({"type": {"const": "sphere"}, "sphere": exactly({"radius": POSITIVE})}),
        exactly({"type": {"const": "cylinder"}, "cylinder": ROUND}),
        exactly({"type": {"const": "capsule"}, "capsule": ROUND}),
    ]
}
IMPLICIT = exactly({"shapes": {"type": "array", "items": SHAPE, "minItems": 1}})
MOTION = exactly(
    {
        "mass": POSITIVE,
        "centerOfMass": several(NUMBER, 3),
        "inertiaDiagonal": several(POSITIVE, 3),
        "inertiaOrientation": several(NUMBER, 4),
    }
)
GEOMETRY = {"oneOf": [exactly({"shape": INDEX}), exactly({"node": INDEX, "convexHull": {"const": True}})]}
ON_A_NODE = {"oneOf": [exactly({"motion": MOTION}), exactly({"collider": exactly({"geometry": GEOMETRY})})]}


def varied() -> Assembly:
    """In millimetres, Y up: natives, a frustum, a round cone that only two radii hold, a plate with a hole, a
    repeated rod, and a pyramid, which is a hull."""
    rod = Part(Cylinder(5, 60), (0, 200, 0), name="leg/a", instances=(Similarity(translation=(50, 0, 0)),))
    holed = Part(Box((80, 80, 10)), (0, 0, 200), name="plate") - Part(
        Cylinder(20, 30), (0, 0, 200), name="hole"
    )
    parts = (
        Part(Box((40, 30, 20)), name="block"),
        Part(Sphere(15), (80, 0, 0), name="ball"),
        Part(Frustum(20, 10, 40), (-80, 0, 0), (0.8, 0.6, 0, 0), name="foot"),
        Part(SuperFrustum((60, 60, 60), taper=0.0), (0, -150, 0), name="spike é"),
        rod,
        holed,
    )
    return Assembly(parts, unit="mm", up="y", name="varied")


def document(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


def convex(mesh: trimesh.Trimesh) -> bool:
    """Whether no corner is beyond the plane of any triangle, by more than float32 is off."""
    beyond = np.einsum("fij,fj->fi", mesh.vertices[None] - mesh.triangles[:, :1], mesh.face_normals)
    return bool(mesh.is_watertight and beyond.max() < 1e-6 * np.ptp(mesh.bounds, axis=0).max())


def implicit_mesh(shape: dict[str, Any]) -> trimesh.Trimesh:
    """A shape of KHR_implicit_shapes, which stands along Y, from its points' hull."""
    about = shape[shape["type"]]
    if shape["type"] == "box":
        return trimesh.creation.box(about["size"])
    if shape["type"] == "sphere":
        return trimesh.creation.icosphere(subdivisions=4, radius=about["radius"])
    points = []
    for radius, y in (
        (about["radiusBottom"], -about["height"] / 2),
        (about["radiusTop"], about["height"] / 2),
    ):
        end = trimesh.creation.icosphere(subdivisions=4).vertices * radius
        if shape["type"] == "cylinder":
            turn = np.linspace(0, 2 * math.pi, 128, endpoint=False)
            end = radius * np.column_stack([np.cos(turn), 0 * turn, np.sin(turn)])
        points.append(end + np.array([0, y, 0]))
    return trimesh.PointCloud(np.concatenate(points)).convex_hull


def khr_colliders(path: Path) -> list[trimesh.Trimesh]:
    """In the scene's frame: shapes placed by their nodes, and hulls of the nodes that they refer to."""
    tree, scene = document(path), trimesh.load_scene(path)
    shapes = tree["extensions"]["KHR_implicit_shapes"]["shapes"]
    meshes = []
    for node in tree["nodes"]:
        collider = node.get("extensions", {}).get("KHR_physics_rigid_bodies", {}).get("collider")
        if collider is None:
            continue
        geometry = collider["geometry"]
        if "node" in geometry:
            name = tree["meshes"][tree["nodes"][geometry["node"]]["mesh"]]["name"]
            meshes.append(scene.geometry[name].convex_hull)
            assert "translation" not in node
            continue
        x, y, z, w = node["rotation"]
        pose = Similarity(1.0, (w, x, y, z), tuple(node["translation"]))
        meshes.append(implicit_mesh(shapes[geometry["shape"]]).apply_transform(pose.matrix()))
    return meshes


def test_khr_turns_are_within_gltf_s_limits(tmp_path: Path) -> None:
    """An upright cylinder is turned to Y and back: of a quaternion no number may exceed 1."""
    export(Assembly((Part(Cylinder(1, 2), name="a"),), unit="m", up="z"), tmp_path / "a.glb", physics="khr")
    turns = [node["rotation"] for node in document(tmp_path / "a.glb")["nodes"] if "rotation" in node]
    assert len(turns) == 1
    assert turns[0] == pytest.approx([0, 0, 0, 1])
    assert np.abs(turns).max() <= 1


def test_khr_is_what_the_extensions_ask_for(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    export(varied(), path, physics="khr", free_joint=True, density=2700.0, resolution=24, tolerance=0.01)
    tree = document(path)
    jsonschema.validate(tree["extensions"]["KHR_implicit_shapes"], IMPLICIT)
    bodies = [n["extensions"]["KHR_physics_rigid_bodies"] for n in tree["nodes"] if "extensions" in n]
    for body in bodies:
        jsonschema.validate(body, ON_A_NODE)
    assert set(tree["extensionsUsed"]) == {"KHR_implicit_shapes", "KHR_physics_rigid_bodies"}
    shapes = tree["extensions"]["KHR_implicit_shapes"]["shapes"]
    assert {shape["type"] for shape in shapes} >= {"box", "sphere", "cylinder"}
    assert shapes[2]["cylinder"] == pytest.approx({"height": 0.04, "radiusBottom": 0.02, "radiusTop": 0.01})
    motions = [body["motion"] for body in bodies if "motion" in body]
    own = mass_properties(varied().transformed(to_gltf(varied())))
    assert len(motions) == 1
    assert motions[0]["mass"] == pytest.approx(2700 * own.volume)
    assert motions[0]["centerOfMass"] == pytest.approx(own.centre, abs=1e-9)
    x, y, z, w = motions[0]["inertiaOrientation"]
    turn = Similarity(1.0, (w, x, y, z)).matrix()[:3, :3]
    again = turn @ np.diag(motions[0]["inertiaDiagonal"]) @ turn.T
    assert np.allclose(again, 2700 * own.inertia, rtol=1e-6, atol=1e-9)
    drawn = {tree["nodes"][i]["name"] for i in reachable(tree)}
    assert not [name for name in drawn if name.endswith("hull")]
    assert [m["message"] for m in validated(path)["messages"] if m["severity"] < 2] == []


def reachable(tree: dict[str, Any]) -> set[int]:
    waiting, found = list(tree["scenes"][0]["nodes"]), set()
    while waiting:
        found.add(i := waiting.pop())
        waiting += tree["nodes"][i].get("children", [])
    return found


def test_khr_colliders_are_where_the_parts_are(tmp_path: Path) -> None:
    """In metres with Y up, each copy by itself, the hole open."""
    path = tmp_path / "a.glb"
    export(varied(), path, physics="khr", resolution=24, tolerance=0.01)
    union = trimesh.boolean.union(khr_colliders(path), engine="manifold")
    moved = varied().transformed(to_gltf(varied()))
    assert np.abs(union.bounds - np.array(moved.bounds())).max() < 2e-3
    assert union.volume == pytest.approx(mass_properties(moved).volume, rel=0.03)
    hole = Similarity(1e-3)(np.array([[0.0, 0.0, 200.0]]))
    assert not union.contains(hole).any()
    assert not any("motion" in str(node.get("extensions")) for node in document(path)["nodes"])


def test_a_round_cone_is_a_capsule_of_two_radii() -> None:
    """It is all balls between its two."""
    cone = RoundCone(0.5, 0.2, 2.0)
    points = np.random.default_rng(0).uniform(-2, 2, (2000, 3)).astype(np.float32)
    share = np.linspace(0, 1, 1001)
    centres = np.column_stack([0 * share, 0 * share, 2 * share - 1])
    to_balls = np.linalg.norm(points[:, None] - centres, axis=2) - (0.5 - 0.3 * share)
    assert np.abs(cone(points) - to_balls.min(axis=1)).max() < 1e-4
    lower, upper = cone.bounds()
    assert np.allclose([lower, upper], [[-0.5, -0.5, -1.5], [0.5, 0.5, 1.2]])
    near = nearest_solid(
        Part(SuperFrustum((0.62, 0.62, 2.2), 1.0, 0.18, 0.15)), (Capsule, Cylinder, RoundCone)
    )
    assert isinstance(near.solid, RoundCone)
    assert near.volume_error_ratio < 0.1
    with pytest.raises(ParameterError, match="within the other"):
        RoundCone(1.0, 0.1, 0.5)


def named_meshes(path: Path) -> dict[str, trimesh.Trimesh]:
    """Objects of a GLB or OBJ by name, in place."""
    if path.suffix == ".glb":
        scene = trimesh.load_scene(path)
        return {
            name: scene.geometry[scene.graph[name][1]].copy().apply_transform(scene.graph[name][0])
            for name in scene.graph.nodes_geometry
        }
    meshes: dict[str, trimesh.Trimesh] = {}
    places: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    for word, *rest in (line.split() for line in path.read_text().splitlines()):
        if word == "o":
            faces[rest[0]] = []
        elif word == "v":
            places.append([float(x) for x in rest])
        elif word == "f":
            faces[list(faces)[-1]].append([int(i) - 1 for i in rest])
    for name, rows in faces.items():
        mesh = trimesh.Trimesh(places, rows, process=False)
        mesh.remove_unreferenced_vertices()
        meshes[name] = mesh
    return meshes


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_unreal_finds_colliders_by_their_names(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    pill = Part(SuperFrustum((2, 2, 50), roundness=1.0, dilation=4.0), (0, 240, 0), name="pill")  # nearly one
    export(varied() | pill, path, physics="unreal", resolution=24, tolerance=0.01)
    meshes = named_meshes(path)
    colliders = {name: mesh for name, mesh in meshes.items() if name[:4] in ("UBX_", "USP_", "UCP_", "UCX_")}
    for name, mesh in colliders.items():
        prefix, of, number = name[:3], name[4:-3], name[-2:]
        assert of in meshes, name
        assert number.isdigit()
        assert convex(mesh), name
        assert len(mesh.vertices) <= 255
        assert len(mesh.vertices) == {"UBX": 8, "USP": 162}.get(prefix, len(mesh.vertices))
        shown = meshes[of]  # a collider is about what it is of
        slack = 0.1 * np.ptp(shown.bounds, axis=0).max()
        assert (mesh.bounds[0] > shown.bounds[0] - slack).all()
        assert (mesh.bounds[1] < shown.bounds[1] + slack).all()
    hulls = {"UCX_foot_01", "UCX_leg_a_01", "UCX_plate_04"}
    assert {"UBX_block_01", "USP_ball_01", "UCP_pill_01", *hulls} <= {*colliders}
    assert "spike_" in meshes
    whole = trimesh.boolean.union([m for n, m in colliders.items() if "plate" in n], engine="manifold")
    assert whole.volume == pytest.approx(abs(meshes["plate"].volume), rel=0.05)


def test_godot_finds_convex_colliders_by_their_names(tmp_path: Path) -> None:
    export(varied(), tmp_path / "a.glb", physics="godot", resolution=24, tolerance=0.01)
    meshes = named_meshes(tmp_path / "a.glb")
    colliders = {name: mesh for name, mesh in meshes.items() if name.endswith("-convcolonly")}
    assert {"block_01-convcolonly", "plate_02-convcolonly"} <= {*colliders}
    assert all(map(convex, colliders.values()))
    plate = [mesh for name, mesh in colliders.items() if name.startswith("plate")]
    hole = np.array([[0.0, 0.0, 0.2]])
    assert not any(mesh.contains(hole).any() for mesh in plate)


def test_usd_physics_is_clean_and_native(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdValidation

    path = tmp_path / "a.usda"
    export(varied(), path, physics="usd", free_joint=True, density=2700.0, resolution=24, tolerance=0.01)
    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [(e.GetName(), e.GetMessage()) for e in errors] == []
    root = stage.GetDefaultPrim()
    own = mass_properties(varied())
    mass = UsdPhysics.MassAPI(root)
    assert mass.GetMassAttr().Get() == pytest.approx(2700 * own.volume * 1e-9, rel=1e-6)
    assert np.allclose(mass.GetCenterOfMassAttr().Get(), own.centre, atol=1e-3)
    moments = np.sort(np.linalg.eigvalsh(own.inertia)) * 2700e-9
    assert np.allclose(np.sort(mass.GetDiagonalInertiaAttr().Get()), moments, rtol=1e-5)
    colliders = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.CollisionAPI)]
    types = [prim.GetTypeName() for prim in colliders]
    assert types[:3] == ["Cube", "Sphere", "Cylinder_1"]
    assert types.count("Cylinder") == 2
    found = UsdPhysics.LoadUsdPhysicsFromRange(stage, [Sdf.Path("/")])
    shapes = {kind: descs for kind, (_, descs) in found.items() if "Shape" in str(kind)}
    assert sum(len(descs) for descs in shapes.values()) == len(colliders)
    assert all(desc.isValid and desc.rigidBody == root.GetPath() for ds in shapes.values() for desc in ds)
    for prim in colliders:
        assert UsdGeom.Imageable(prim).ComputePurpose() == UsdGeom.Tokens.guide
    cube = UsdGeom.Imageable(colliders[0]).ComputeWorldBound(0, "guide").ComputeAlignedRange()
    assert np.allclose(cube.GetMax(), (20, 15, 10))


def test_a_collider_that_is_changed_is_reported(tmp_path: Path) -> None:
    export(varied(), tmp_path / "a.obj", physics="unreal", resolution=24)
    changed = json.loads((tmp_path / "a.obj.report.json").read_text())["approximated"]
    assert ["foot"] in [change["parts"] for change in changed]
    export(natives(), tmp_path / "b.glb", physics="khr", resolution=16)
    assert not (tmp_path / "b.glb.report.json").exists()


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("a.glb", {"physics": "havok"}, "expected one of khr, unreal, godot"),
        ("a.glb", {"density": 1.0}, "need physics khr"),
        ("a.glb", {"physics": "unreal", "free_joint": True}, "need physics khr"),
        ("a.obj", {"physics": "khr"}, "unreal, godot in OBJ"),
        ("a.obj", {"tolerance": 0.1}, "needs physics"),
        ("a.usda", {"physics": "khr"}, "expected usd"),
        ("a.usda", {"free_joint": True}, "need physics usd"),
        ("a.ply", {"physics": "khr"}, "no option 'physics'"),
    ],
)
def test_physics_that_there_is_not(tmp_path: Path, name: str, options: dict[str, Any], said: str) -> None:
    if name.endswith("usda"):
        pytest.importorskip("pxr")
    with pytest.raises(SettingError, match=said):
        export(natives(), tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


def test_from_the_command_line(tmp_path: Path) -> None:
    natives().save(tmp_path / "a.json")
    assert main(["export", str(tmp_path / "a.json"), "-o", str(tmp_path / "a.glb"), "--physics", "khr"]) == 0
    assert "KHR_implicit_shapes" in document(tmp_path / "a.glb")["extensionsUsed"]
