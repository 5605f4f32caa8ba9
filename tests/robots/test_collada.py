"""COLLADA: in metres, by the names of its nodes, and SDFormat's submeshes of it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.errors import EmptyShapeError, RobotError, UnreadableFileError
from partwright.robots import CollideOptions, collide
from partwright.shapes.collada import read_collada

pytest.importorskip("collada")

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>
    <unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries>{geometries}</library_geometries>
  <library_visual_scenes><visual_scene id="s">
    <node id="n1" name="frame"><node>
      <matrix>1 0 0 0 0 1 0 0 0 0 1 500 0 0 0 1</matrix><instance_geometry url="#box"/>
    </node></node>
    <node id="n2" name="lid">{mirror}<instance_geometry url="#ball"><bind_material><technique_common>
      <instance_material symbol="gone" target="#gone"/>
    </technique_common></bind_material></instance_geometry></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""
GEOMETRY = """<geometry id="{0}"><mesh>
  <source id="{0}p"><float_array id="{0}a" count="{1}">{2}</float_array><technique_common>
    <accessor source="#{0}a" count="{3}" stride="3">
      <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
    </accessor></technique_common></source>
  <vertices id="{0}v"><input semantic="POSITION" source="#{0}p"/></vertices>
  <triangles count="{4}"><input semantic="VERTEX" source="#{0}v" offset="0"/><p>{5}</p></triangles>
</mesh></geometry>"""
SDF = """<sdf version="1.9"><model name="tin">
  <link name="body"><collision name="c"><geometry><mesh><uri>tin.dae</uri>
    <scale>2 2 2</scale>{0}</mesh></geometry></collision></link>
</model></sdf>
"""


MIRROR = "<matrix>-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"
TWICE = """<library_nodes>
    <node id="turned" name="wheel"><matrix>1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1</matrix>
      <instance_geometry url="#ball"/></node>
  </library_nodes>
  <library_visual_scenes><visual_scene id="s">
    <node id="n1" name="rover"><instance_node url="#turned"/></node>
    <node id="n2"><matrix>-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url="#turned"/></node>
  </visual_scene></library_visual_scenes>"""


def tin(folder: Path, mirror: str = "") -> Path:
    """A box of 1 x 2 x 3 m, 5 m up, and beside its foot a ball of a fifth of a metre, in centimetres."""
    box = trimesh.creation.box((100, 200, 300))
    ball = trimesh.creation.icosphere(subdivisions=2, radius=20)
    ball.apply_translation((1000, 0, 0))
    text = ""
    for name, mesh in (("box", box), ("ball", ball)):
        places, corners = (" ".join(map(str, each.ravel().tolist())) for each in (mesh.vertices, mesh.faces))
        text += GEOMETRY.format(
            name, mesh.vertices.size, places, len(mesh.vertices), len(mesh.faces), corners
        )
    path = folder / "tin.dae"
    path.write_text(DAE.format(geometries=text, mirror=mirror))
    return path


def test_it_is_in_metres_and_has_its_nodes_names(tmp_path: Path) -> None:
    """As Gazebo and ROS show it: its up axis is no matter. A material that is not there neither."""
    frame, lid = read_collada(tin(tmp_path)).pieces
    assert (frame.name, lid.name) == ("frame", "lid")
    assert np.allclose(np.ptp(frame.vertices, axis=0), (1, 2, 3))
    assert np.allclose(frame.vertices.mean(axis=0), (0, 0, 5))
    assert np.allclose(lid.vertices.mean(axis=0), (10, 0, 0))


def volumes(path: Path) -> list[float]:
    return [trimesh.Trimesh(piece.vertices, piece.faces).volume for piece in read_collada(path).pieces]


def test_what_a_node_mirrors_is_solid(tmp_path: Path) -> None:
    """It came inside out: a cavity, where it lay within another."""
    plain, mirrored = volumes(tin(tmp_path)), volumes(tin(tmp_path, MIRROR))
    assert plain[0] == pytest.approx(6)
    assert mirrored == pytest.approx(plain)


def test_a_node_that_is_referred_to_has_its_own_name_and_is_mirrored_as_often_as_it_is(
    tmp_path: Path,
) -> None:
    path = tin(tmp_path)
    ball = volumes(path)[1]
    before, _, after = path.read_text().partition("<library_visual_scenes>")
    path.write_text(before + TWICE + after.partition("</library_visual_scenes>")[2])
    assert [piece.name for piece in read_collada(path).pieces] == ["wheel", "wheel"]
    assert volumes(path) == pytest.approx([ball, ball])


@pytest.mark.parametrize(
    ("submesh", "low", "high"),
    [
        ("", (-1, -2, -0.4), (20.4, 2, 13)),
        ("<submesh><name>frame</name></submesh>", (-1, -2, 7), (1, 2, 13)),
        ("<submesh><name>frame</name><center>true</center></submesh>", (-1, -2, -3), (1, 2, 3)),
        ("<submesh><name>lid</name><center>1</center></submesh>", (-0.4, -0.4, -0.4), (0.4, 0.4, 0.4)),
    ],
)
def test_a_submesh_is_what_collides(
    tmp_path: Path, submesh: str, low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    tin(tmp_path)
    path = tmp_path / "tin.sdf"
    path.write_text(SDF.format(submesh))
    shapes = collide(path, CollideOptions(kinds=("hull",))).shapes["body"]
    corners = np.concatenate([shape.mesh.vertices for shape in shapes])
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], [low, high], atol=0.02)


def test_what_it_lacks_is_told(tmp_path: Path) -> None:
    mesh = tin(tmp_path)
    path = tmp_path / "tin.sdf"
    path.write_text(SDF.format("<submesh><name>handle</name></submesh>"))
    with pytest.raises(RobotError, match=r"'body': tin.dae: .* no submesh 'handle'; it has frame, lid"):
        collide(path)
    without = DAE.format(geometries="", mirror="")
    mesh.write_text(without)
    with pytest.raises(UnreadableFileError, match="Geometry #box not found"):
        read_collada(mesh)
    mesh.write_text(
        re.sub(
            "<instance_geometry.*?>|</instance_geometry>|<bind_material>.*</bind_material>",
            "",
            without,
            flags=re.S,
        )
    )
    with pytest.raises(EmptyShapeError, match="no triangles"):
        read_collada(mesh)
    mesh.write_text("<html>not found</html>")
    with pytest.raises((UnreadableFileError, EmptyShapeError)):
        read_collada(mesh)


def test_what_of_a_mesh_could_not_be_read_is_told(tmp_path: Path) -> None:
    tin(tmp_path)
    dae = tmp_path / "tin.dae"
    dae.write_text(dae.read_text().replace('url="#ball"', 'url="#gone"'))
    path = tmp_path / "tin.sdf"
    path.write_text(SDF.format(""))
    (link,) = collide(path, CollideOptions()).links
    assert link.notes == ("tin.dae: left out 1 body that could not be read",)
