"""SDFormat in, SDFormat out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from partwright.errors import PartwrightError, RobotError, UnreadableFileError
from partwright.robots import CollideOptions, collide, open_robot, save
from tests.robots.robots import urdf

SDF = """<?xml version="1.0"?>
<!-- kept -->
<sdf version="1.9">
  <model name="pair">
    <pose>0 0 1 0 0 0</pose>
    <link name="base">
      <inertial><mass>2</mass></inertial>
      <visual name="v"><geometry><mesh><uri>meshes/seen.stl</uri></mesh></geometry></visual>
      <collision name="hit">
        <pose>0.5 0 0 0 0 1.5707963267948966</pose>
        <geometry><mesh><uri>model://my_robot/meshes/ell.stl</uri><scale>0.1 -0.1
        0.1</scale></mesh></geometry> <surface><friction><ode><mu>0.7</mu></ode></friction></surface>
      </collision>
      <collision name="native"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>
    </link>
    <model name="gripper">
      <pose degrees="true">0 0 1 0 90 0</pose>
      <link name="finger">
        <collision name="rod"><geometry><mesh><uri>meshes/rod.stl</uri></mesh></geometry></collision>
      </link>
    </model>
    <joint name="grip" type="revolute"><parent>base</parent><child>gripper::finger</child></joint>
  </model>
</sdf>
"""


def model(tmp_path: Path) -> Path:
    folder = tmp_path / "my_robot"
    urdf(folder)
    path = folder / "pair.sdf"
    path.write_text(SDF)
    return path


def test_collisions_are_replaced_and_keep_their_surface(tmp_path: Path) -> None:
    result = collide(model(tmp_path))
    assert [s.kind for s in result.shapes["base"]] == ["box", "box"]
    assert [s.kind for s in result.shapes["gripper::finger"]] == ["cylinder"]
    save(result, tmp_path / "out")
    text = (tmp_path / "out" / "pair.sdf").read_text()
    assert "<!-- kept -->" in text
    root = etree.fromstring(text.encode())
    base = root.find("model/link[@name='base']")
    collisions = base.findall("collision")
    assert [c.find("geometry")[0].tag for c in collisions] == ["box", "box", "sphere"]
    assert [c.findtext("surface/friction/ode/mu") for c in collisions] == ["0.7", "0.7", None]
    assert base.findtext("inertial/mass") == "2"
    assert (tmp_path / "out" / "meshes" / "seen.stl").exists()
    finger = root.find("model/model/link/collision")
    assert float(finger.findtext("geometry/cylinder/radius")) == pytest.approx(0.2, rel=0.01)


def test_poses_scales_and_nested_models(tmp_path: Path) -> None:
    robot = open_robot(model(tmp_path))
    base, finger = robot.links
    assert finger.name == "gripper::finger"
    assert finger.parents == ("base",)
    assert np.allclose(finger.pose[:3, 3], (0, 0, 2))
    assert np.allclose(finger.pose[:3, :3] @ (0, 0, 1), (1, 0, 0))
    corners = np.concatenate(
        [s.mesh.vertices for s in collide(robot, CollideOptions(kinds=("hull",))).shapes["base"]]
    )
    # the L of 0.2 is mirrored along y, then turned a quarter, and moved
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], [[0.5, 0, 0], [0.7, 0.2, 0.1]], atol=1e-3)
    assert len(base.natives) == 1


def test_hulls_lie_in_the_model_s_own_folder_by_its_address(tmp_path: Path) -> None:
    result = collide(model(tmp_path), CollideOptions(kinds=("hull",)))
    save(result, tmp_path / "out")
    text = (tmp_path / "out" / "pair.sdf").read_text()
    assert "<uri>model://my_robot/collision/base_collision_1.stl</uri>" in text
    assert 'new="' not in text
    assert (tmp_path / "out" / "my_robot" / "collision" / "base_collision_1.stl").exists()
    again = open_robot(tmp_path / "out" / "pair.sdf")
    assert [len(link.collisions) for link in again.links] == [2, 1]


def test_a_loop_of_joints_stays(tmp_path: Path) -> None:
    """As a rod beside a leg closes it: SDFormat has such joints, and links have poses of their own."""
    back = '<joint name="rod" type="ball"><parent>gripper::finger</parent><child>base</child></joint>'
    path = model(tmp_path)
    path.write_text(SDF.replace("  </model>\n</sdf>", f"  {back}</model>\n</sdf>"))
    result = collide(path)
    assert [link.parents for link in result.robot.links] == [("gripper::finger",), ("base",)]
    save(result, tmp_path / "out")
    root = etree.parse(tmp_path / "out" / "pair.sdf").getroot()
    assert [joint.get("name") for joint in root.iter("joint")] == ["grip", "rod"]


FRAMES = """<sdf version="1.9"><world name="w"><model name="arm" placement_frame="foot">
  <pose>0 0 5 0 0 0</pose>
  <link name="base"><pose>1 0 0 0 0 0</pose></link>
  <frame name="foot" attached_to="base"><pose>0 0 -1 0 0 0</pose></frame>
  <joint name="hinge" type="revolute"><pose relative_to="base">0 0 2 0 0 1.5707963267948966</pose>
    <parent>base</parent><child>upper</child></joint>
  <link name="upper"><pose relative_to="hinge">3 0 0 0 0 0</pose>
    <collision name="hit"><pose relative_to="hand::palm">0 0 0 0 0 0</pose>
      <geometry><mesh><uri>meshes/ell.stl</uri></mesh></geometry></collision></link>
  <model name="hand"><pose relative_to="upper">0 0 0.5 0 0 0</pose>
    <link name="palm"><pose>0 0 0.5 0 0 0</pose></link></model>
</model></world></sdf>
"""


def test_poses_relative_to_joints_and_frames_as_converters_from_urdf_write_them(tmp_path: Path) -> None:
    path = model(tmp_path)
    path.write_text(FRAMES)
    robot = open_robot(path)
    places = {link.name.split("::", 1)[1]: link for link in robot.links}
    # the foot, one below the base, is at 5
    assert np.allclose(places["base"].pose, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 6], [0, 0, 0, 1]])
    assert np.allclose(places["upper"].pose[:3, 3], (0, 3, 8))
    assert np.allclose(places["upper"].pose[:3, 0], (0, 1, 0))
    assert np.allclose(places["hand::palm"].pose[:3, 3], (0, 3, 9))
    assert np.allclose(places["upper"].collisions[0].matrix[:3, 3], (0, 0, 1))
    save(collide(robot, CollideOptions(kinds=("hull",))), tmp_path / "out")
    written = etree.parse(tmp_path / "out" / "pair.sdf").getroot()
    assert [pose.get("relative_to") for pose in written.iter("pose")] == [
        *(None, None, None, "base", "hinge", "upper", None)
    ]
    path.write_text(FRAMES.replace('relative_to="base"', 'relative_to="upper"'))
    with pytest.raises(RobotError, match="the pose of 'upper' is relative to itself"):
        open_robot(path)


def test_maps_of_materials_come_along(tmp_path: Path) -> None:
    path = model(tmp_path)
    (path.parent / "textures").mkdir()
    (path.parent / "textures" / "skin.png").write_bytes(b"picture")
    maps = "<albedo_map>textures/skin.png</albedo_map><normal_map>textures/none.png</normal_map>"
    material = f"<material><pbr><metal>{maps}</metal></pbr></material></visual>"
    path.write_text(SDF.replace("</visual>", material))
    save(collide(path), tmp_path / "out")
    assert (tmp_path / "out" / "textures" / "skin.png").read_bytes() == b"picture"
    assert maps in (tmp_path / "out" / "pair.sdf").read_text()


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("meshes/rod.stl", "meshes/gone.stl", UnreadableFileError, "link 'gripper::finger': its mesh"),
        ("model://my_robot/meshes/ell", "model://nobody/ell", UnreadableFileError, "no package nobody"),
        ("<pose>0.5 0 0 0", "<pose>0.5 0 0", RobotError, "'base': pose: expected six numbers"),
        ("<pose>0.5", '<pose relative_to="tool">0.5', RobotError, "relative to 'tool'"),
        ("<radius>0.1", "<radius>wide", RobotError, "link 'base': collision: radius"),
    ],
)
def test_broken_models(tmp_path: Path, old: str, new: str, error: type[PartwrightError], words: str) -> None:
    path = model(tmp_path)
    assert old in SDF
    path.write_text(SDF.replace(old, new))
    with pytest.raises(error, match=words):
        open_robot(path)
