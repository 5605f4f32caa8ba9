"""MJCF in, MJCF out, as MuJoCo itself reads it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly.similarity import rotation_matrix
from partwright.errors import RobotError, UnreadableFileError
from partwright.export.mjcf import geom_size
from partwright.robots import CollideOptions, collide, open_robot, save
from tests.robots.robots import mjcf

mujoco = pytest.importorskip("mujoco")


def both(tmp_path: Path, **options: Any) -> tuple[Any, Any]:
    """The model before and after."""
    path = mjcf(tmp_path / "in")
    save(collide(path, CollideOptions(**options)), tmp_path / "out")
    return [mujoco.MjModel.from_xml_path(str(p)) for p in (path, tmp_path / "out" / "pair.xml")]  # type: ignore[return-value]


def test_bodies_joints_and_inertias_are_the_same(tmp_path: Path) -> None:
    before, after = both(tmp_path)
    for name in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "jnt_type"):
        assert np.allclose(getattr(before, name), getattr(after, name), rtol=1e-6), name
    assert [before.body(i).name for i in range(before.nbody)] == [
        after.body(i).name for i in range(after.nbody)
    ]


def test_colliding_meshes_are_native_and_the_only_sight_stays(tmp_path: Path) -> None:
    _, after = both(tmp_path)
    collides = (after.geom_contype != 0) | (after.geom_conaffinity != 0)
    kinds = after.geom_type[collides].tolist()
    assert kinds.count(int(mujoco.mjtGeom.mjGEOM_BOX)) == 2  # the L
    assert kinds.count(int(mujoco.mjtGeom.mjGEOM_SPHERE)) == 1  # the ball
    assert int(mujoco.mjtGeom.mjGEOM_MESH) not in kinds
    tip = after.geom("tip")  # weighs, and is seen
    assert (tip.contype[0], tip.conaffinity[0], tip.group[0]) == (0, 0, 0)
    boxes = [i for i in range(after.ngeom) if after.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX]
    assert {int(after.geom_group[i]) for i in boxes} == {3}
    assert {int(after.geom_condim[i]) for i in boxes} == {4}  # as their class says


def test_geoms_are_in_place_through_classes_scales_and_angles(tmp_path: Path) -> None:
    before, after = both(tmp_path)
    boxes = []
    for model in (before, after):
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        corners = []
        for i in range(model.ngeom):
            if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE or not model.geom_contype[i]:
                continue
            if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_MESH:
                mesh = model.geom_dataid[i]
                local = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
            else:
                centre, half = np.split(model.geom_aabb[i], 2)
                local = centre + np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * half
            corners.append(local @ data.geom_xmat[i].reshape(3, 3).T + data.geom_xpos[i])
        boxes.append([np.concatenate(corners).min(axis=0), np.concatenate(corners).max(axis=0)])
    assert np.allclose(boxes[0], boxes[1], atol=0.01)


def test_contact_pairs_reach_every_new_geom_and_files_keep_their_text(tmp_path: Path) -> None:
    _, after = both(tmp_path)
    assert after.npair == 2
    assert "<!-- kept -->" in (tmp_path / "out" / "pair.xml").read_text()
    body = (tmp_path / "out" / "body.xml").read_text()
    assert "<!-- seen and hit, and what the body weighs by -->" in body
    assert '<include file="body.xml"/>' in (tmp_path / "out" / "pair.xml").read_text()
    assert (tmp_path / "out" / "assets" / "ell.stl").exists()


def test_hulls_lie_in_the_file_itself(tmp_path: Path) -> None:
    _, after = both(tmp_path, kinds=("hull",))
    collides = (after.geom_contype != 0) & (after.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH))
    assert collides.sum() == 3


def test_a_folder_above_is_drawn_in(tmp_path: Path) -> None:
    path = mjcf(tmp_path / "in")
    (tmp_path / "in" / "assets").rename(tmp_path / "assets")
    path.write_text(path.read_text().replace('meshdir="assets"', 'meshdir="../assets"'))
    save(collide(path), tmp_path / "out")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "pair.xml")).nmesh == 2


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("ell.stl", "gone.stl", UnreadableFileError, "link 'base': its mesh 'ell' is not there"),
        ('mesh="ball"', 'mesh="bell"', RobotError, "link 'tip': no asset is the mesh 'bell'"),
        ("body.xml", "nobody.xml", UnreadableFileError, "include 'nobody.xml' is not there"),
        ('pos="0.5 0 0"', 'pos="0.5 0 x"', RobotError, "body 'base': pos: expected 3 numbers"),
        ("<body", "<body name='base'/><body", RobotError, "two bodies are named 'base'"),
    ],
)
def test_broken_models(tmp_path: Path, old: str, new: str, error: type[Exception], words: str) -> None:
    path = mjcf(tmp_path)
    for file in (path, tmp_path / "body.xml"):
        file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(error, match=words):
        open_robot(path)


def test_includes_without_end(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    path.write_text('<mujoco><include file="a.xml"/></mujoco>')
    with pytest.raises(RobotError, match="included twice"):
        open_robot(path)


@pytest.mark.parametrize("kind", ["capsule", "cylinder", "box", "ellipsoid"])
def test_geoms_between_two_ends_are_where_mujoco_has_them(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a.xml"
    path.write_text(
        f"""<mujoco><worldbody><body name="a" pos="1 0 0" euler="0 30 0">
        <geom type="{kind}" size="0.1" fromto="0.2 0 0 0.5 -0.4 0.3"/></body></worldbody></mujoco>"""
    )
    [link] = [link for link in open_robot(path).links if link.name == "a"]
    [part] = link.natives
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert np.allclose(link.pose @ [*part.translation, 1], [*data.geom_xpos[0], 1])
    axis = link.pose[:3, :3] @ rotation_matrix(part.rotation)[:, 2]
    assert abs(axis @ data.geom_xmat[0].reshape(3, 3)[:, 2]) == pytest.approx(1)
    assert np.allclose(geom_size(part.field), model.geom_size[0][: len(geom_size(part.field))])


def test_the_last_word_of_a_compiler_counts_where_its_include_stands(tmp_path: Path) -> None:
    """An included file that is read before the file's own compiler says nothing of folders any more."""
    path = mjcf(tmp_path / "in")
    (path.parent / "first.xml").write_text('<mujoco><compiler meshdir="elsewhere" angle="radian"/></mujoco>')
    own = '<compiler angle="degree" meshdir="assets"/>'
    assert own in path.read_text()
    path.write_text(path.read_text().replace(own, f'<include file="first.xml"/>\n  {own}'))
    bodies = mujoco.MjModel.from_xml_path(str(path)).nbody
    result = collide(path, CollideOptions(kinds=("box",), max_parts=1))
    save(result, tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / path.name))
    assert model.nbody == bodies
    base = next(link for link in result.robot.links if link.name == "base")
    assert np.allclose(base.pose[:3, :2], [[0, -1], [1, 0], [0, 0]], atol=1e-12)  # 90 degrees
