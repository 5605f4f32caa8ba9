"""Assemblies of several links, and what is seen apart from what collides, as MuJoCo and yourdfpy read it."""

from __future__ import annotations

import dataclasses
import math
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.errors import ParameterError, SettingError
from partwright.export import export
from partwright.fields import Box, Sphere, Tube
from partwright.meshing.mass import mass_properties
from partwright.robots import open_robot

HINGE = {
    "joint": "revolute",
    "joint_origin": "-50 0 20",
    "joint_axis": "0 1 0",
    "joint_lower": -1.5,
    "joint_upper": 0,
}


def chest(**hinge: Any) -> Assembly:
    """A body of two parts in millimetres with Z up, and a lid on it that turns about its back edge."""
    body = Assembly(
        (Part(Box((100, 60, 40)), name="box"), Part(Sphere(5), (52, 0, 0), name="lock")), name="body"
    )
    lid = Part(Box((100, 60, 4)), (0, 0, 22), name="lid", metadata=HINGE | hinge, blend=1.0)
    return Assembly((body, lid), unit="mm", up="z", name="chest")


def test_two_nodes_are_two_urdf_links_with_a_joint(tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy")
    path = tmp_path / "chest.urdf"
    export(chest(), path)
    robot = yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)
    assert robot.validate()
    assert [*robot.link_map] == ["body", "lid"]
    joint = robot.joint_map["lid joint"]
    assert (joint.type, joint.parent, joint.child) == ("revolute", "body", "lid")
    assert np.allclose(joint.origin[:3, 3], (-0.05, 0, 0.02))
    assert np.allclose(joint.axis, (0, 1, 0))
    assert (joint.limit.lower, joint.limit.upper) == (-1.5, 0)
    assert np.allclose(robot.collision_scene.bounds, [[-0.05, -0.03, -0.02], [0.057, 0.03, 0.024]], atol=1e-6)
    robot.update_cfg([-math.pi / 2])  # opened, the lid stands on its back edge
    opened = [[-0.054, -0.03, -0.02], [0.057, 0.03, 0.12]]
    assert np.allclose(robot.collision_scene.bounds, opened, atol=1e-6)
    masses = [link.inertial.mass for link in robot.robot.links]
    assert masses == pytest.approx(
        [1000 * mass_properties(part).volume * 1e-9 for part in chest().children], rel=1e-5
    )


def test_two_nodes_are_two_sdf_links_with_a_joint(tmp_path: Path) -> None:
    path = tmp_path / "chest.sdf"
    export(chest(), path, free_joint=True)
    robot = open_robot(path)
    body, lid = robot.links
    assert (body.parents, lid.parents) == ((), ("body",))
    assert np.allclose(lid.pose[:3, 3], (-0.05, 0, 0.02))
    assert [part.field for part in body.natives] == [Box((0.1, 0.06, 0.04)), Sphere(0.005)]
    assert np.allclose(lid.natives[0].translation, (0.05, 0, 0.002))
    model = xml.parse(path).getroot().find("model")
    assert model is not None
    assert model.findtext("static") == "false"
    assert model.findtext("joint/axis/xyz") == "0 1 0"
    assert [float(model.findtext(f"joint/axis/limit/{end}", "")) for end in ("lower", "upper")] == [-1.5, 0]


def test_two_nodes_are_two_mjcf_bodies_with_a_joint(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "chest.mjcf"
    turned = dataclasses.replace(chest(), up="y")  # in MJCF y is z
    export(turned, path, free_joint=True)
    model = mujoco.MjModel.from_xml_path(str(path))
    assert [model.body(i).name for i in range(model.nbody)] == ["world", "body", "lid"]
    assert model.body("lid").parentid == model.body("body").id
    assert np.allclose(model.body("lid").pos, (-0.05, -0.02, 0))
    assert np.allclose(model.joint("lid joint").axis, (0, 0, 1))
    assert np.allclose(model.joint("lid joint").range, (-1.5, 0))
    assert model.nq == 8


@pytest.mark.parametrize("suffix", [".urdf", ".mjcf"])
def test_each_child_is_a_link_where_that_is_asked_for(tmp_path: Path, suffix: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    plain = dataclasses.replace(chest().children[1], metadata={})
    arm = Part(
        Box((10, 10, 50)), (0, 0, 50), name="arm", metadata={"joint_parent": "lid", "joint": "prismatic"}
    )
    arm = dataclasses.replace(arm, metadata={**arm.metadata, "joint_lower": 0, "joint_upper": 30})
    path = tmp_path / f"a{suffix}"
    export(Assembly((chest().children[0], plain, arm), unit="mm", up="z"), path, links=True)
    model = mujoco.MjModel.from_xml_path(str(path))
    assert model.njnt == 1
    assert np.allclose(model.jnt_range[0], (0, 0.03))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint": "ball"}, "joint of 'lid': expected one of fixed, revolute"),
        ({"joint_lower": 2}, "needs joint_lower below joint_upper"),
        ({"joint_upper": "far"}, "joint_upper is no number: 'far'"),
        ({"joint_axis": "0 0 0"}, "its axis has no length"),
        ({"joint_axis": "up"}, "joint_axis of 'lid': expected three numbers, got 'up'"),
        ({"joint_origin": "0 0 inf"}, "expected finite numbers"),
        ({"joint_parent": "base"}, "there is no link 'base'; links are body, lid"),
        ({"joint_parent": "lid"}, "the joints of 'lid' form a loop"),
    ],
)
def test_joints_that_make_no_sense(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        export(chest(**changes), tmp_path / "a.urdf")
    assert not list(tmp_path.iterdir())


def test_links_of_what_has_none(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="expected a union of several"):
        export(Part(Box((2, 2, 2))) - Part(Sphere(1)), tmp_path / "a.mjcf", links=True)


def test_what_is_seen_is_the_shape_and_what_collides_is_apart(tmp_path: Path) -> None:
    """A tube collides as hulls in group 3 and is seen, hole and all, in group 2; a box is both."""
    mujoco = pytest.importorskip("mujoco")
    cup = Assembly(
        (Part(Tube(30, 10, 50), name="cup"), Part(Box((20, 20, 20)), (80, 0, 0), name="cube")), unit="mm"
    )
    export(cup, tmp_path / "a.mjcf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "a.mjcf"))
    seen = [i for i in range(model.ngeom) if model.geom_group[i] <= 2]
    collide = [i for i in range(model.ngeom) if model.geom_contype[i]]
    assert sorted(model.geom(i).name for i in seen) == ["cube", "cup visual"]
    assert {int(model.geom_group[i]) for i in collide if model.geom(i).name != "cube"} == {3}
    assert len(collide) > 4
    mesh = model.geom_dataid[model.geom("cup visual").id]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    begin, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    shown = trimesh.Trimesh(model.mesh_vert[first : first + count], model.mesh_face[begin : begin + faces])
    assert abs(shown.volume) == pytest.approx(math.pi * (0.03**2 - 0.02**2) * 0.05, rel=0.01)
    weight = mass_properties(cup).volume * 1e-6
    assert model.body_mass.sum() == pytest.approx(weight, rel=1e-3)
    export(cup, tmp_path / "b.mjcf", visuals=False)
    bare = mujoco.MjModel.from_xml_path(str(tmp_path / "b.mjcf"))
    assert set(bare.geom_group) == {0}
    assert bare.ngeom == len(collide)
