"""Small robots, written to a folder: known meshes, known volumes."""

from __future__ import annotations

from pathlib import Path

import trimesh

URDF = """<?xml version="1.0"?>
<!-- kept -->
<robot name="pair">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base">
    <inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="{visual}"/></geometry><material name="grey"/></visual>
    <!-- the collision of the base -->
    <collision name="base mesh">
      <origin xyz="0 0 0.5" rpy="0 0 0"/>
      <geometry><mesh filename="{base}"/></geometry>
    </collision>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <link name="arm">
    <collision><geometry><mesh filename="{arm}" scale="{scale}"/></geometry></collision>
  </link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 1.2" rpy="0 0 1.5707963267948966"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="other" multiplier="2"/>
  </joint>
</robot>
"""

MJCF = """<mujoco model="pair">
  <!-- kept -->
  <compiler angle="degree" meshdir="assets"/>
  <default>
    <default class="collision"><geom group="3" condim="4" type="mesh"/></default>
    <default class="visual"><geom group="2" contype="0" conaffinity="0" type="mesh"/></default>
  </default>
  <asset>
    <mesh name="ell" file="ell.stl" scale="0.1 0.1 0.1"/>
    <mesh name="ball" file="ball.stl"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <include file="body.xml"/>
  </worldbody>
  <contact><pair geom1="floor" geom2="ell hit"/></contact>
</mujoco>
"""
BODY = """<mujoco>
  <body name="base" pos="0 0 1" euler="0 0 90">
    <inertial pos="0 0 0" mass="3" diaginertia="1 1 1"/>
    <freejoint/>
    <geom class="visual" mesh="ell"/>
    <geom name="ell hit" class="collision" mesh="ell" pos="0.5 0 0"/>
    <body name="tip" pos="2 0 0">
      <joint type="hinge"/>
      <!-- seen and hit, and what the body weighs by -->
      <geom name="tip" type="mesh" mesh="ball"/>
    </body>
  </body>
</mujoco>
"""


def ell() -> trimesh.Trimesh:
    """Two boxes in an L: volume 3, convex in no way, of two boxes exactly."""
    return trimesh.boolean.union(
        [
            trimesh.creation.box(bounds=[[0, 0, 0], [2, 1, 1]]),
            trimesh.creation.box(bounds=[[0, 0, 0], [1, 2, 1]]),
        ],
        engine="manifold",
    )


def urdf(
    folder: Path, base: str = "meshes/ell.stl", arm: str = "meshes/rod.stl", scale: str = "1 1 1"
) -> Path:
    """A base that is an L, and an arm that is a rod, with meshes beside the file."""
    meshes = folder / "meshes"
    meshes.mkdir(parents=True)
    ell().export(meshes / "ell.stl")
    trimesh.creation.cylinder(0.2, 1.0, sections=48).export(meshes / "rod.stl")
    trimesh.creation.icosphere(radius=0.3).export(meshes / "seen.stl")
    path = folder / "pair.urdf"
    path.write_text(URDF.format(visual="meshes/seen.stl", base=base, arm=arm, scale=scale))
    return path


def mjcf(folder: Path) -> Path:
    """A base that is an L a tenth as large, and a tip that is a ball, in an included file."""
    (folder / "assets").mkdir(parents=True)
    ell().export(folder / "assets" / "ell.stl")
    trimesh.creation.icosphere(subdivisions=3, radius=0.3).export(folder / "assets" / "ball.stl")
    (folder / "body.xml").write_text(BODY)
    path = folder / "pair.xml"
    path.write_text(MJCF)
    return path
