"""URDF as MuJoCo and yourdfpy read it."""

from __future__ import annotations

import json
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part
from partwright.assembly.similarity import rotation_matrix
from partwright.atomic_io import report_path
from partwright.errors import NothingToExportError, ParameterError
from partwright.export import export
from partwright.export.urdf import roll_pitch_yaw
from partwright.fields import SuperFrustum
from partwright.meshing.mass import mass_properties
from tests.export.robotics import awkward, natives


def test_mujoco_reads_solids_mass_and_inertia(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "a.urdf"
    export(natives(), path, density=500.0, free_joint=True)
    loaded = mujoco.MjModel.from_xml_path(str(path))
    kinds = mujoco.mjtGeom
    expected = [kinds.mjGEOM_BOX, kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE]
    expected += [kinds.mjGEOM_CYLINDER, kinds.mjGEOM_SPHERE, kinds.mjGEOM_SPHERE]
    collision = loaded.geom_type[loaded.geom_contype > 0]
    assert collision.tolist() == [int(kind) for kind in expected]
    properties = mass_properties(natives().scaled(1e-3))
    assert loaded.body_mass[1:].sum() == pytest.approx(500 * properties.volume, rel=1e-6)
    principal = np.sort(np.linalg.eigvalsh(properties.inertia)) * 500
    assert np.allclose(np.sort(loaded.body_inertia[1]), principal, rtol=1e-5)
    data = mujoco.MjData(loaded)
    for _ in range(200):
        mujoco.mj_step(loaded, data)
    assert np.isfinite(data.qpos).all()


def test_yourdfpy_finds_everything_in_its_place(tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy")
    path = tmp_path / "a.urdf"
    export(natives(), path)
    robot = yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)
    assert robot.validate()
    assert list(robot.link_map) == ["natives"]
    assert len(robot.link_map["natives"].collisions) == 6
    bounds = natives().scaled(1e-3).bounds()
    assert np.allclose(robot.collision_scene.bounds, bounds, atol=2e-3)
    assert np.allclose(robot.scene.bounds, bounds, atol=2e-3)


def test_meshes_lie_beside_it_where_no_solid_fits(tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy")
    path = tmp_path / "a.urdf"
    export(awkward(), path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "a.urdf",
        "a.urdf.report.json",
        "a_block.stl",
        "a_cup.stl",
        "a_hook.stl",  # to be seen: it collides as a chain
        "a_spike.stl",
    ]
    robot = yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)
    assert np.allclose(robot.collision_scene.bounds, awkward().bounds(), atol=0.02)
    meshes = list(robot.collision_scene.geometry.values())
    assert all(mesh.is_watertight for mesh in meshes)
    assert sum(mesh.volume for mesh in meshes) == pytest.approx(mass_properties(awkward()).volume, rel=0.05)
    changes = json.loads(report_path(path).read_text())["approximated"]
    assert {tuple(change["parts"]): change["to"] for change in changes} == {
        ("hook",): "chain of 3 solids",
        ("spike",): "mesh",
        ("cup",): "mesh",
        ("block", "hole"): "mesh",
    }


def test_no_visual_without_its_collision(tmp_path: Path) -> None:
    export(natives(), tmp_path / "a.urdf")
    link = xml.parse(tmp_path / "a.urdf").getroot().find("link")
    assert link is not None
    assert len(link.findall("visual")) == len(link.findall("collision")) == 6
    assert {e.get("name") for e in link.findall("visual/material")} == {
        "base",
        "post",
        "ball & <socket>",
        "rod",
    }


unit = st.floats(-1, 1)


@given(st.tuples(unit, unit, unit, unit).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_angles_are_the_rotation(q: tuple[float, float, float, float]) -> None:
    check_angles(rotation_matrix(tuple(np.array(q) / np.linalg.norm(q))))


@pytest.mark.parametrize("w", [0.5, -0.5])
@pytest.mark.parametrize("roll", [0.0, 1.0])
def test_angles_where_x_points_along_z(w: float, roll: float) -> None:
    turn = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    check_angles(rotation_matrix((np.sqrt(0.5), 0, np.sign(w) * np.sqrt(0.5), 0)) @ turn)


def check_angles(rotation: np.ndarray) -> None:
    r, p, y = roll_pitch_yaw(rotation)
    halves = [(np.cos(a / 2), np.eye(3)[i] * np.sin(a / 2)) for i, a in enumerate((r, p, y))]
    x, z, around = (rotation_matrix((c, *axis)) for c, axis in (halves[0], halves[2], halves[1]))
    assert np.allclose(z @ around @ x, rotation, atol=1e-6)


@pytest.mark.parametrize("unit", ["um", "km"])
def test_sizes_from_micrometres_to_kilometres(tmp_path: Path, unit: str) -> None:
    export(Assembly(awkward().children, unit=unit, up="z"), tmp_path / "a.urdf")
    mesh = trimesh.load_mesh(tmp_path / "a_spike.stl", process=False)
    metres = {"um": 1e-6, "km": 1e3}[unit]
    assert np.allclose(mesh.extents / metres, (0.6, 0.6, 0.9), rtol=0.02)


def test_bad_input(tmp_path: Path) -> None:
    with pytest.raises(NothingToExportError, match="nothing to export"):
        export(Assembly((Part(SuperFrustum((1, 1, 1), onion=1.0)),)), tmp_path / "a.urdf")
    with pytest.raises(ParameterError, match="density"):
        export(natives(), tmp_path / "a.urdf", density=float("nan"))
    assert not list(tmp_path.iterdir())
