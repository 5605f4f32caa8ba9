"""USD robots: read and written by usd-core, held to all of its validators."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.cli.main import main
from partwright.errors import PartwrightError, RobotError, UnreadableFileError
from partwright.export import export
from partwright.fields import Box, Sphere
from partwright.robots import CollideOptions, collide, open_robot, save
from tests.robots.robots import ell

pxr = pytest.importorskip("pxr")


def add_mesh(stage: Any, path: str, mesh: trimesh.Trimesh, scale: float = 1.0) -> Any:
    from pxr import UsdGeom

    made = UsdGeom.Mesh.Define(stage, path)
    made.CreatePointsAttr((mesh.vertices * scale).tolist())
    made.CreateFaceVertexCountsAttr([3] * len(mesh.faces))
    made.CreateFaceVertexIndicesAttr(mesh.faces.ravel().tolist())
    made.CreateSubdivisionSchemeAttr("none")
    made.CreateExtentAttr((mesh.bounds * scale).tolist())
    return made


def robot(folder: Path, name: str = "pair.usda", joints: int = 1) -> Path:
    """In centimetres, Z up: a base that is an L of 3 m3 with a cube that collides natively, and a mirrored L
    that hangs on it, in a layer of its own that is drawn in as an instance."""
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    folder.mkdir(parents=True, exist_ok=True)
    part = Usd.Stage.CreateNew(str(folder / "arm.usda"))
    UsdGeom.SetStageMetersPerUnit(part, 0.01)
    UsdGeom.SetStageUpAxis(part, "Z")
    part.SetDefaultPrim(UsdGeom.Xform.Define(part, "/shape").GetPrim())
    UsdPhysics.CollisionAPI.Apply(add_mesh(part, "/shape/hit", ell(), 100).GetPrim())
    part.Save()
    stage = Usd.Stage.CreateNew(str(folder / name))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/pair").GetPrim())
    base, arm = (UsdGeom.Xform.Define(stage, f"/pair/{each}") for each in ("base", "arm"))
    arm.AddTranslateOp().Set(Gf.Vec3d(0, 0, 300))
    for link in (base, arm):
        UsdPhysics.RigidBodyAPI.Apply(link.GetPrim())
    UsdPhysics.MassAPI.Apply(base.GetPrim()).CreateMassAttr(7.0)
    seen = add_mesh(stage, "/pair/base/seen", trimesh.creation.icosphere(radius=30))
    seen.GetPrim().SetDocumentation("kept")
    mesh = add_mesh(stage, "/pair/base/hit", ell(), 50)
    mesh.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
    cube = UsdGeom.Cube.Define(stage, "/pair/base/box")
    cube.CreateSizeAttr(10)
    cube.CreateExtentAttr([(-5, -5, -5), (5, 5, 5)])
    UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
    shape = UsdGeom.Xform.Define(stage, "/pair/arm/shape")
    shape.AddScaleOp().Set(Gf.Vec3f(1, -1, 1))
    shape.GetPrim().GetReferences().AddReference("arm.usda")
    shape.GetPrim().SetInstanceable(True)
    ends = [("/pair/base", "/pair/arm"), ("/pair/arm", "/pair/base")]
    for i, (parent, child) in enumerate(ends[:joints]):
        joint = UsdPhysics.RevoluteJoint.Define(stage, f"/pair/hinge_{i}")
        joint.CreateBody0Rel().SetTargets([parent])
        joint.CreateBody1Rel().SetTargets([child])
    stage.Save()
    return folder / name


def test_links_are_read_in_metres_with_their_joints(tmp_path: Path) -> None:
    read = open_robot(robot(tmp_path))
    base, arm = read.links
    assert (base.name, base.parents, arm.name, arm.parents) == ("base", (), "arm", ("base",))
    assert np.allclose(arm.pose[:3, 3], (0, 0, 3))
    assert (len(base.collisions), len(base.visuals), len(base.natives)) == (1, 1, 1)
    assert base.natives[0].field == Box((0.1, 0.1, 0.1))
    result = collide(read)
    assert [link.volume for link in result.links] == pytest.approx([3.0, 3.0])
    assert {link.link: link.shapes for link in result.links} == {"base": {"box": 2}, "arm": {"box": 2}}


def test_the_robot_has_native_colliders_and_is_else_the_same(tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom, UsdPhysics, UsdValidation

    out = tmp_path / "out"
    save(collide(robot(tmp_path / "in")), out)
    names = {path.name for path in out.iterdir()}
    assert names == {"pair.usda", "arm.usda", "pair.usda.report.json", "pair.usda.png"}
    assert (out / "arm.usda").read_bytes() == (tmp_path / "in" / "arm.usda").read_bytes()
    stage = Usd.Stage.Open(str(out / "pair.usda"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    before = Usd.Stage.Open(str(tmp_path / "in" / "pair.usda"))
    context = UsdValidation.ValidationContext(validators)
    assert len(context.Validate(stage)) == len(context.Validate(before)) == 0
    assert stage.GetPrimAtPath("/pair/base/seen").GetDocumentation() == "kept"
    assert UsdPhysics.MassAPI(stage.GetPrimAtPath("/pair/base")).GetMassAttr().Get() == 7.0
    for path in ("/pair/base/hit", "/pair/arm/shape/hit"):
        assert UsdPhysics.CollisionAPI(stage.GetPrimAtPath(path)).GetCollisionEnabledAttr().Get() is False
    for name in ("base", "arm"):
        made = stage.GetPrimAtPath(f"/pair/{name}/collision_shapes")
        assert [prim.GetTypeName() for prim in made.GetChildren()] == ["Cube", "Cube"]
    box = (
        UsdGeom.BBoxCache(0, ["guide"])
        .ComputeWorldBound(stage.GetPrimAtPath("/pair/arm"))
        .ComputeAlignedRange()
    )
    assert np.allclose(box.GetMin(), (0, -200, 300), atol=1e-3)
    assert np.allclose(box.GetMax(), (200, 0, 400), atol=1e-3)
    again = open_robot(out / "pair.usda")
    assert [len(link.natives) for link in again.links] == [3, 2]
    assert not any(link.collisions for link in again.links)


@pytest.mark.parametrize("own", [False, True])
def test_a_group_that_collides_makes_what_is_below_it_collide(tmp_path: Path, own: bool) -> None:
    """As meshes that are merged, or drawn in as instances, have it; own: the mesh itself has it, too."""
    from pxr import Usd, UsdGeom, UsdPhysics

    path = robot(tmp_path / "in")
    stage = Usd.Stage.Open(str(path))
    group = UsdGeom.Xform.Define(stage, "/pair/arm/group")
    stage.GetPrimAtPath("/pair/arm/shape").SetActive(False)
    UsdPhysics.CollisionAPI.Apply(group.GetPrim())
    cube = UsdGeom.Cube.Define(stage, "/pair/arm/group/cube")
    cube.CreateSizeAttr(10)
    inner = UsdGeom.Xform.Define(stage, "/pair/arm/group/shape").GetPrim()
    inner.GetReferences().AddReference("arm.usda")
    inner.SetInstanceable(True)
    add_mesh(stage, "/pair/arm/seen", trimesh.creation.icosphere(radius=30))
    stage.Save()
    if not own:
        layer = Usd.Stage.Open(str(path.parent / "arm.usda"))
        layer.GetPrimAtPath("/shape/hit").RemoveAPI(UsdPhysics.CollisionAPI)
        layer.Save()
    arm = open_robot(path).links[1]
    assert (len(arm.collisions), len(arm.visuals), len(arm.natives)) == (1, 1, 1)
    save(collide(path), tmp_path / "out")
    made = Usd.Stage.Open(str(tmp_path / "out" / "pair.usda"))
    asked = UsdPhysics.CollisionAPI(made.GetPrimAtPath("/pair/arm/group")).GetCollisionEnabledAttr()
    assert asked.Get() is False
    assert made.GetPrimAtPath("/pair/arm/group/shape").IsInstance() is not own
    again = open_robot(tmp_path / "out" / "pair.usda").links[1]
    assert (len(again.collisions), len(again.visuals), len(again.natives)) == (0, 1, 3)


@pytest.mark.parametrize("own", [False, True])
def test_a_link_that_is_an_instance_gets_colliders(tmp_path: Path, own: bool) -> None:
    """own: its mesh collides by itself, not as part of the link."""
    from pxr import Usd, UsdPhysics

    path = robot(tmp_path / "in")
    stage = Usd.Stage.Open(str(path))
    arm = stage.GetPrimAtPath("/pair/arm")
    stage.RemovePrim("/pair/arm/shape")
    arm.GetReferences().AddReference("arm.usda")
    arm.SetInstanceable(True)
    if not own:
        UsdPhysics.CollisionAPI.Apply(arm)
        layer = Usd.Stage.Open(str(path.parent / "arm.usda"))
        layer.GetPrimAtPath("/shape/hit").RemoveAPI(UsdPhysics.CollisionAPI)
        layer.Save()
    stage.Save()
    save(collide(path), tmp_path / "out")
    again = open_robot(tmp_path / "out" / "pair.usda")
    assert [(len(link.collisions), len(link.natives)) for link in again.links] == [(0, 3), (0, 2)]


def test_a_loop_of_joints_stays(tmp_path: Path) -> None:
    from pxr import Usd, UsdPhysics

    result = collide(robot(tmp_path / "in", joints=2))
    assert [link.parents for link in result.robot.links] == [("arm",), ("base",)]
    save(result, tmp_path / "out")
    stage = Usd.Stage.Open(str(tmp_path / "out" / "pair.usda"))
    assert sum(bool(UsdPhysics.Joint(prim)) for prim in stage.Traverse()) == 2


def test_an_export_s_own_colliders_are_read_back(tmp_path: Path) -> None:
    parts = (
        Part(Box((30, 20, 10)), (5, 0, 0), (0.8, 0.6, 0, 0), name="a"),
        Part(Sphere(5), (0, 40, 0), name="b"),
    )
    export(Assembly(parts, unit="mm", up="z"), tmp_path / "a.usdc", physics="usd", free_joint=True)
    (link,) = open_robot(tmp_path / "a.usdc").links
    found = Assembly(link.natives)
    assert np.allclose(found.bounds(), Assembly(parts).scaled(1e-3).bounds(), atol=1e-6)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda folder: written(folder / "a.usda", "#usda 1.0\ndef Xform"), "cannot be read as USD"),
        (lambda folder: written(folder / "a.usda", '#usda 1.0\ndef Xform "x" {}\n'), "is a rigid body"),
        (lambda folder: written(folder / "a.usdz", "PK"), "unpack it"),
    ],
)
def test_broken_robots_are_one_line_and_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], make: Any, said: str
) -> None:
    path = make(tmp_path / "in")
    assert main(["collide", str(path), "-o", str(tmp_path / "out")]) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if "error" in line]
    assert len(errors) == 1
    assert said in errors[0]
    assert not (tmp_path / "out").exists()


def written(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_files_that_are_missing_or_elsewhere_are_named(tmp_path: Path) -> None:
    path = robot(tmp_path / "in")
    (tmp_path / "in" / "arm.usda").rename(tmp_path / "arm.usda")
    result = collide(path)  # the base is there
    with pytest.raises(UnreadableFileError, match=r"arm\.usda, which is not there"):
        save(result, tmp_path / "out")
    path.write_text(path.read_text().replace("@arm.usda@", "@../arm.usda@"))
    with pytest.raises(RobotError, match="outside of its folder"):
        save(collide(path), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def meshes(folder: Path) -> Path:
    folder.mkdir()
    ell().export(folder / "ell.stl")
    ell().export(folder / "other.obj")
    (folder / "notes.txt").write_text("kept out")
    return folder


def test_a_folder_of_meshes_becomes_convex_pieces(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = meshes(tmp_path / "in")
    assert main(["collide", str(folder), "-o", str(tmp_path / "out")]) == 0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"ell.stl", "other.obj", "in.report.json", "in.png"}
    for name in ("ell.stl", "other.obj"):
        whole = trimesh.load_mesh(tmp_path / "out" / name)
        pieces = whole.split()
        assert len(pieces) == 2
        assert all(piece.is_convex for piece in pieces)
        assert sum(piece.volume for piece in pieces) == pytest.approx(3.0, rel=0.01)
    assert (tmp_path / "out" / "other.obj").read_text().count("\no ") == 2
    assert main(["collide", str(folder), "-o", str(folder)]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_folders_that_will_not_do(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="no mesh is in this folder"):
        open_robot(tmp_path)
    with pytest.raises(PartwrightError, match="has no 'box'"):
        collide(meshes(tmp_path / "in"), CollideOptions(kinds=("box",)))
