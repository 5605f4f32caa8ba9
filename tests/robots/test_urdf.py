"""URDF in, URDF out: what collides is replaced, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from lxml import etree

from partwright.errors import PartwrightError, RobotError, UnreadableFileError, UnsupportedFormatError
from partwright.robots import CollideOptions, collide, open_robot, paths, save
from partwright.robots.xml_files import parsed
from tests.robots.robots import ell, urdf


def without_collisions(path: Path) -> bytes:
    """The file without what collides, and without the spaces between elements."""
    tree = etree.parse(str(path), etree.XMLParser(remove_blank_text=True))
    for collision in tree.getroot().xpath("//collision[geometry/mesh or @name]"):
        collision.getparent().remove(collision)
    for element in tree.getroot().iter():
        element.tail = None
        element.text = (element.text or "").strip() or None
    return etree.tostring(tree, method="c14n")


def test_an_ell_becomes_two_boxes_and_all_else_stays(tmp_path: Path) -> None:
    path = urdf(tmp_path / "in")
    result = collide(path, CollideOptions(kinds=("box", "hull")))
    assert [s.kind for s in result.shapes["base"]] == ["box", "box"]
    volumes = [s.part.field.superfrustum().size for s in result.shapes["base"]]
    assert sum(np.prod(size) for size in volumes) == pytest.approx(3.0, rel=1e-3)
    written = save(result, tmp_path / "out")
    assert without_collisions(path) == without_collisions(tmp_path / "out" / "pair.urdf")
    text = (tmp_path / "out" / "pair.urdf").read_text()
    assert "<!-- kept -->" in text
    assert "<!-- the collision of the base -->" in text
    assert '<sphere radius="0.1"/>' in text
    names = {str(p.relative_to(tmp_path / "out")) for p in written}
    assert {"pair.urdf", "pair.urdf.report.json", "pair.urdf.png", "meshes/seen.stl"} <= names
    assert "meshes/ell.stl" not in names


def test_a_convex_link_gets_the_one_shape_that_is_nearest(tmp_path: Path) -> None:
    """A rod is a cylinder; where cylinders are not wanted its hull, not a box."""
    path = urdf(tmp_path / "in")
    rod = collide(path).shapes["arm"]
    assert [s.kind for s in rod] == ["cylinder"]
    assert (rod[0].part.field.radius, rod[0].part.field.height) == pytest.approx((0.2, 1.0), rel=1e-2)
    assert [s.kind for s in collide(path, CollideOptions(kinds=("box", "hull"))).shapes["arm"]] == ["hull"]


def test_the_robot_is_read_by_another_program(tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip("yourdfpy")
    save(collide(urdf(tmp_path / "in"), CollideOptions(kinds=("hull",))), tmp_path / "out")
    robot = yourdfpy.URDF.load(
        str(tmp_path / "out" / "pair.urdf"), build_collision_scene_graph=True, load_collision_meshes=True
    )
    box = robot.collision_scene.bounds
    # the base's L lies from 0.5 to 1.5 above, the arm's rod from 0.7 to 1.7
    assert np.allclose(box, [[-0.2, -0.2, -0.1], [2, 2, 1.7]], atol=0.02)


@pytest.mark.parametrize("scale", ["1 1 1", "1 -1 1", "0.5 2 -1"])
def test_scaled_and_mirrored_meshes_keep_their_place(tmp_path: Path, scale: str) -> None:
    path = urdf(tmp_path / "in", arm="meshes/ell.stl", scale=scale)
    result = collide(path, CollideOptions(kinds=("hull",)))
    report = next(link for link in result.links if link.link == "arm")
    factors = np.array([float(word) for word in scale.split()])
    assert report.volume == pytest.approx(3 * abs(factors.prod()), rel=1e-6)
    assert report.missing + report.extra < 1e-3
    corners = np.concatenate([s.mesh.vertices for s in result.shapes["arm"]])
    expected = np.sort(np.array([[0, 0, 0], [2, 2, 1]]) * factors, axis=0)
    assert np.allclose([corners.min(axis=0), corners.max(axis=0)], expected, atol=1e-3)


def test_package_paths_are_kept_and_found(tmp_path: Path) -> None:
    folder = tmp_path / "ws" / "my_robot"
    path = urdf(folder, base="package://my_robot/meshes/ell.stl")
    result = collide(path, CollideOptions(kinds=("hull",)))
    save(result, tmp_path / "out")
    text = (tmp_path / "out" / "pair.urdf").read_text()
    assert text.count('filename="package://my_robot/collision/base_collision_') == len(result.shapes["base"])
    assert len(list((tmp_path / "out" / "my_robot" / "collision").iterdir())) == len(result.shapes["base"])
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    moved = elsewhere / "pair.urdf"
    moved.write_text(
        path.read_text()
        .replace("meshes/rod.stl", str(folder / "meshes" / "rod.stl"))
        .replace("meshes/seen.stl", str(folder / "meshes" / "seen.stl"))
    )
    with pytest.raises(UnreadableFileError, match=r"link 'base': no package my_robot .*--packages"):
        open_robot(moved)
    assert len(open_robot(moved, [tmp_path / "ws"]).links) == 2
    moved.write_text(moved.read_text().replace("package://", "package:///"))
    assert len(open_robot(moved, [tmp_path / "ws"]).links) == 2


def test_a_package_is_found_by_the_name_that_it_gives_itself(tmp_path: Path) -> None:
    """A download's folder has another name."""
    folder = tmp_path / "my_robot-main"
    path = urdf(folder, base="package://my_robot/meshes/ell.stl")
    with pytest.raises(UnreadableFileError, match="no package my_robot"):
        open_robot(path)
    (folder / "package.xml").write_text("<package><!-- <name>my_robot</name> --><name>other</name></package>")
    with pytest.raises(UnreadableFileError, match="no package my_robot"):
        open_robot(path)
    (folder / "package.xml").write_text(
        "<package format='3'>\n  <!-- <name>template</name> -->\n"
        "  <author><name>me</name></author><name> my_robot </name>\n</package>\n"
    )
    save(collide(path, CollideOptions(kinds=("hull",))), tmp_path / "out")
    assert list((tmp_path / "out" / "my_robot" / "collision").iterdir())
    away = tmp_path / "away.urdf"
    away.write_text(path.read_text().replace('"meshes/', f'"{folder}/meshes/'))
    assert len(open_robot(away, [folder]).links) == 2


def test_the_file_of_a_package_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was read for each mesh, and twice."""
    folder = tmp_path / "my_robot-main"
    path = urdf(folder, base="package://my_robot/meshes/ell.stl", arm="package://my_robot/meshes/rod.stl")
    (folder / "package.xml").write_text("<package><name>my_robot</name></package>")
    read: list[Path] = []

    def counted(file: Path, tag: str | None) -> object:
        read.append(file)
        return parsed(file, tag)

    monkeypatch.setattr(paths, "parsed", counted)
    assert len(open_robot(path).links) == 2
    assert read == [folder / "package.xml"]


def test_the_report_says_how_far_off_and_who_collides(tmp_path: Path) -> None:
    result = collide(urdf(tmp_path / "in"), CollideOptions(kinds=("box",), max_parts=1))
    save(result, tmp_path / "out")
    report = json.loads((tmp_path / "out" / "pair.urdf.report.json").read_text())
    base, arm = report["links"]
    assert base["shapes"] == {"box": 1}
    assert base["volume"] == pytest.approx(3.0)
    assert base["max_deviation"] > base["tolerance"]  # one box for an L is far off, and it says so
    assert any("link 'base': the shapes are" in warning for warning in report["warnings"])
    assert not any(
        "'arm'" in warning and arm["max_deviation"] <= arm["tolerance"] for warning in report["warnings"]
    )
    assert 0 < base["volume_missing_ratio"] + base["volume_extra_ratio"] < 1
    # the rod stands in the L's corner at rest, half of it above
    pair = report["shared_volumes_at_rest"][0]
    assert pair["links"] == ["base", "arm"]
    assert pair["before"] == pytest.approx(np.pi * 0.04 * 0.8 / 4, rel=0.02)
    assert arm["meshes"] == ["rod.stl"]


def test_pictures_of_materials_come_along(tmp_path: Path) -> None:
    """One that is there, one in a package, and one that is not, which stays as it was said."""
    path = urdf(tmp_path / "ws" / "my_robot")
    for name in ("skin.png", "grip.png"):
        (path.parent / name).write_bytes(name.encode())
    materials = "".join(
        f'<material name="{i}"><texture filename="{address}"/></material>'
        for i, address in enumerate(("skin.png", "package://my_robot/grip.png", "gone.png"))
    )
    changed(path, '<link name="base">', f'{materials}<link name="base">')
    save(collide(path, CollideOptions(kinds=("box",), max_parts=1)), tmp_path / "out")
    assert (tmp_path / "out" / "skin.png").read_bytes() == b"skin.png"
    assert (tmp_path / "out" / "my_robot" / "grip.png").read_bytes() == b"grip.png"
    assert materials in (tmp_path / "out" / "pair.urdf").read_text()


def test_capsules_that_are_asked_for_are_said_by_what_urdf_has(tmp_path: Path) -> None:
    """A cylinder and two spheres; without being asked for, a rod is one cylinder."""
    path = urdf(tmp_path / "in")
    rod = trimesh.creation.capsule(1.0, 0.2, count=[48, 48])  # its ends at -0.5 and 0.5
    rod.export(tmp_path / "in" / "meshes" / "rod.stl")
    result = collide(path, CollideOptions(kinds=("box", "capsule"), max_parts=4))
    (capsule,) = result.shapes["arm"]
    assert capsule.kind == "capsule"
    save(result, tmp_path / "out")
    link = etree.parse(tmp_path / "out" / "pair.urdf").getroot().findall("link")[1]
    solids = [each.find("geometry")[0] for each in link.findall("collision")]
    assert [each.tag for each in solids] == ["cylinder", "sphere", "sphere"]
    assert float(solids[0].get("length")) == pytest.approx(1.0, rel=0.01)
    assert [float(each.get("radius")) for each in solids] == pytest.approx([0.2] * 3, rel=0.01)
    heights = [float(c.find("origin").get("xyz").split()[2]) for c in link.findall("collision")[1:]]
    assert np.ptp(heights) == pytest.approx(1.0, rel=0.01)
    assert "capsule" not in {shape.kind for shape in collide(path).shapes["arm"]}


def changed(path: Path, old: str, new: str) -> Path:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("meshes/ell.stl", "meshes/gone.stl", UnreadableFileError, r"link 'base': its mesh meshes/gone.stl"),
        ("meshes/ell.stl", "package://nobody/a.stl", UnreadableFileError, r"link 'base': no package nobody"),
        ("meshes/ell.stl", "package://in/../../etc/passwd", UnreadableFileError, r"link 'base': .*outside"),
        ('xyz="0 0 0.5"', 'xyz="0 0 north"', RobotError, r"'base': xyz: expected three numbers"),
        ('<child link="arm"/>', '<child link="base"/>', RobotError, r"loop"),
        ('<child link="arm"/>', '<child link="leg"/>', RobotError, r"joint 'hinge': its child link 'leg'"),
        ('scale="1 1 1"', 'scale="1 0 1"', RobotError, r"link 'arm': the scale of rod.stl"),
        ("</robot>", "", UnreadableFileError, r"pair.urdf: it is no XML"),
        ("robot", "model", RobotError, r"its root is <model>, expected <robot>"),
    ],
)
def test_broken_robots_are_one_line_and_write_nothing(
    tmp_path: Path, old: str, new: str, error: type[PartwrightError], words: str
) -> None:
    path = changed(urdf(tmp_path / "in"), old, new)
    with pytest.raises(error, match=words) as caught:
        save(collide(path), tmp_path / "out")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_meshes_without_volume_name_their_link(tmp_path: Path) -> None:
    path = urdf(tmp_path / "in")
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    flat.export(tmp_path / "in" / "meshes" / "rod.stl")
    with pytest.raises(PartwrightError, match=r"link 'arm': rod.stl"):
        collide(path)
    (tmp_path / "in" / "meshes" / "rod.stl").write_bytes(b"solid")
    with pytest.raises(PartwrightError, match=r"link 'arm': rod.stl"):
        collide(path)


def test_a_sheet_that_is_seen_is_enclosed(tmp_path: Path) -> None:
    """A label without thickness beside a solid link: seen, and to be contained; what collides is no sheet."""
    path = urdf(tmp_path / "in")
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    sheet.export(tmp_path / "in" / "meshes" / "seen.stl")
    base = collide(path, CollideOptions(enclose=True)).links[0]
    assert base.sticking_out == 0
    assert base.volume < 0.05
    assert any("does not close" in note for note in base.notes)


def test_an_open_box_is_closed_and_that_is_told(tmp_path: Path) -> None:
    path = urdf(tmp_path / "in")
    box = trimesh.creation.box((1, 1, 1))
    up = box.face_normals[:, 2] > 0.5
    box.update_faces(~up)
    sheet = trimesh.creation.box((1, 1, 1)).submesh([np.flatnonzero(up)], append=True)
    sheet.apply_translation((0, 0, 0.01))  # the lid lies loose upon it
    trimesh.util.concatenate([box, sheet]).export(tmp_path / "in" / "meshes" / "rod.stl")
    arm = next(link for link in collide(path).links if link.link == "arm")
    assert arm.volume == pytest.approx(1.0, rel=0.05)


def test_prefixes_that_nobody_declared_are_kept(tmp_path: Path) -> None:
    path = changed(urdf(tmp_path / "in"), 'effort="1"', 'effort="1" drake:acceleration="10"')
    save(collide(path), tmp_path / "out")
    assert 'drake:acceleration="10"' in (tmp_path / "out" / "pair.urdf").read_text()


def test_what_is_no_robot(tmp_path: Path) -> None:
    with pytest.raises(UnreadableFileError, match="there is no such file"):
        open_robot(tmp_path / "a.urdf")
    ell().export(tmp_path / "a.stl")
    with pytest.raises(UnsupportedFormatError, match=r"expected one of \.urdf"):
        open_robot(tmp_path / "a.stl")
    (tmp_path / "a.urdf").write_text('<robot name="a"><link name="b"/></robot>')
    with pytest.raises(RobotError, match="none of its 1 links has a collision mesh"):
        collide(tmp_path / "a.urdf")
    (tmp_path / "a.urdf").write_text('<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:a/></robot>')
    with pytest.raises(RobotError, match="xacro"):
        open_robot(tmp_path / "a.urdf")


def test_comments_before_the_robot_keep_their_lines(tmp_path: Path) -> None:
    path = urdf(tmp_path / "in")
    head = "<!-- one -->\n<!-- one -->\n<!-- two\n     lines -->\n"
    path.write_text(path.read_text().replace("<!-- kept -->\n", head, 1))
    save(collide(path, CollideOptions(kinds=("box",), max_parts=1)), tmp_path / "out")
    assert head + "<robot " in (tmp_path / "out" / "pair.urdf").read_text()
