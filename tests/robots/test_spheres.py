"""Spheres of links: in what the link is made of, or around it, and what the files say of them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from PIL import Image

from partwright.approximation import ball_filling
from partwright.approximation.ball_filling import filling_balls
from partwright.assembly import Part
from partwright.cli.main import main
from partwright.errors import RobotError, SettingError
from partwright.fields import Box, Capsule, Cylinder, Sphere
from partwright.meshing.manifolds import as_manifold
from partwright.robots import CollideOptions, collide, open_robot, save
from partwright.robots.covering import balls_solid, outside_of_balls
from partwright.robots.model import Link
from partwright.robots.solids import Solids
from partwright.robots.spheres import LinkSpheres, curobo, spheres_for
from tests.robots.robots import urdf

THICK = 0.1
NATIVE = """<robot name="native">
  <link name="post">
    <collision><origin xyz="0 0 0.5"/><geometry><cylinder radius="0.1" length="1"/></geometry></collision>
    <collision><origin xyz="0 0 1"/><geometry><box size="0.4 0.2 0.2"/></geometry></collision>
  </link>
  <link name="ball"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
  <link name="frame"/>
  <joint name="a" type="fixed"><parent link="post"/><child link="ball"/><origin xyz="0 0 2"/></joint>
  <joint name="b" type="fixed"><parent link="ball"/><child link="frame"/></joint>
</robot>"""


def cup() -> trimesh.Trimesh:
    """A cup of radius and height 1 about the origin, its walls a tenth thick: most of it is hollow."""
    outer = trimesh.creation.cylinder(1.0, 1.0, sections=96)
    inner = trimesh.creation.cylinder(1.0 - THICK, 1.0, sections=96)
    inner.apply_translation((0, 0, THICK))
    return trimesh.boolean.difference([outer, inner], engine="manifold")


def cup_robot(folder: Path) -> Path:
    path = urdf(folder)
    cup().export(folder / "meshes" / "rod.stl")
    trimesh.creation.box((1, 1, 1)).export(folder / "meshes" / "ell.stl")  # nothing is asked of the base here
    return path


def of(spheres: list[LinkSpheres], link: str) -> LinkSpheres:
    return next(each for each in spheres if each.link == link)


@pytest.fixture
def few_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing is said of how well the spheres fill their link."""
    monkeypatch.setattr(ball_filling, "_INSIDE", 4000)


@pytest.mark.parametrize("count", [3, 24])
def test_spheres_of_a_hollow_link_are_in_its_walls(count: int) -> None:
    """However few: the middle of the hollow is free, and each centre in the material."""
    balls = filling_balls(as_manifold(cup()), count)
    assert len(balls) == count
    across, along = np.hypot(balls[:, 0], balls[:, 1]), balls[:, 2]
    wall = (across > 1 - THICK) & (across < 1)
    bottom = (along < -0.5 + THICK) & (along > -0.5)
    assert (wall | bottom).all()
    assert balls[:, 3].max() < 1.2 * THICK
    assert outside_of_balls(np.zeros((1, 3)), balls)[0] > 0.2


def dumbbell() -> trimesh.Trimesh:
    """Two balls and a thin rod between: far from any one sphere, and hardly off from two."""
    balls = [trimesh.creation.icosphere(3, 0.4).apply_translation((x, 0, 0)) for x in (-0.5, 0.5)]
    rod = trimesh.creation.cylinder(0.05, segment=[(-0.5, 0, 0), (0.5, 0, 0)])
    return trimesh.boolean.union([*balls, rod], engine="manifold")


@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize("enclose", [False, pytest.param(True, marks=pytest.mark.heavy)])
def test_more_spheres_err_less_and_few_are_warned_of(
    tmp_path: Path, enclose: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    path = cup_robot(tmp_path / "in")
    dumbbell().export(tmp_path / "in" / "meshes" / "rod.stl")
    options = ["--kinds", "box", "--max-parts", "1"] + ["--enclose"] * enclose
    errors = []
    for count in (1, 2):
        out = tmp_path / f"out{count}"
        assert main(["collide", str(path), "-o", str(out), "--spheres", str(count), *options]) == 0
        said = capsys.readouterr()
        report = json.loads((out / "pair.urdf.report.json").read_text())
        arm = next(each for each in report["spheres"] if each["link"] == "arm")
        assert 0 < arm["spheres"] <= count
        errors.append(arm["volume_missing_ratio"] + arm["volume_extra_ratio"])
        few = [line for line in report["warnings"] if "too few to stand for it" in line and "'arm'" in line]
        assert all(line in said.err for line in few)
        assert f"arm   {arm['spheres']:7}" in said.out
        assert (few != []) == (errors[-1] > 0.5)
    assert errors[1] < errors[0] - 0.1
    assert errors[1] < 0.5 < errors[0]


@pytest.mark.usefixtures("few_cells")
def test_enclosing_spheres_contain_every_point(tmp_path: Path) -> None:
    result = collide(
        cup_robot(tmp_path), CollideOptions(enclose=True, spheres=12, kinds=("box",), max_parts=1)
    )
    points, _ = trimesh.sample.sample_surface(cup(), 100_000, seed=3)
    arm = of(result.spheres, "arm")
    assert arm.sticking_out == 0
    assert outside_of_balls(np.concatenate([points, cup().vertices]), arm.balls).max() <= 0
    sizes = arm.balls[:, 3]
    assert sizes.max() > 1.05 * sizes.min()  # each as large as its own share asks for


def test_spheres_inside_reach_nowhere_out(tmp_path: Path) -> None:
    solid = as_manifold(cup())
    balls = filling_balls(solid, 40, "within")
    assert (balls_solid(balls) - solid).volume() < 2e-3 * balls_solid(balls).volume()  # facets reach out
    assert balls[:, 3].max() <= 0.5 * THICK * 1.2  # where bottom and wall meet there is more room


def test_a_cube_is_filled_as_well_as_one_sphere_can() -> None:
    """By volume alone half of the sphere's surface is outside: of a unit cube's faces it cuts caps."""
    [ball] = filling_balls(as_manifold(trimesh.creation.box((1, 1, 1))), 1)
    assert np.allclose(ball[:3], 0, atol=0.03)
    radii = np.linspace(0.5, 0.8, 301)
    height = radii - 0.5
    beyond = (
        6 * np.pi * height**2 * (radii - height / 3)
    )  # six caps; none meet while the radius is under .707
    error = 1 - 4 / 3 * np.pi * radii**3 + 2 * beyond
    assert ball[3] == pytest.approx(radii[error[radii < 0.707].argmin()], abs=0.015)


def test_native_solids_get_spheres_with_and_without_meshes(tmp_path: Path) -> None:
    path = tmp_path / "native.urdf"
    path.write_text(NATIVE)
    result = collide(path, CollideOptions(spheres=16))
    assert [each.link for each in result.spheres] == ["post", "ball"]
    assert np.allclose(of(result.spheres, "ball").balls, [[0, 0, 0, 0.3]])  # it is one itself
    post = of(result.spheres, "post")
    assert post.missing + post.extra < 0.25
    assert outside_of_balls(np.array([[0, 0, 0.1], [0, 0, 0.5], [0.15, 0, 1]]), post.balls).max() < 0
    save(result, tmp_path / "out")
    assert (tmp_path / "out" / "native.urdf").read_text().count("<cylinder") == 1
    assert Image.open(tmp_path / "out" / "native.urdf.png").width == 3 * 140  # see conftest.py
    with pytest.raises(RobotError, match="mesh to replace; 2 collide by native solids"):
        collide(path)


def test_native_solids_beside_meshes_are_filled_too(tmp_path: Path) -> None:
    path = urdf(tmp_path)
    path.write_text(path.read_text().replace('<sphere radius="0.1"/>', '<sphere radius="0.6"/>'))
    [base] = [link for link in open_robot(path).links if link.name == "base"]
    target = Solids().target(base, base.collisions)
    found = spheres_for(base, target, 6, "nearest")
    assert outside_of_balls(np.array([[-0.2, -0.2, -0.2], [1.5, 0.5, 1.0]]), found.balls).max() < 0


@pytest.mark.usefixtures("few_cells")
@pytest.mark.parametrize(
    "field", [Box((1, 2, 3)), Sphere(0.5), Cylinder(0.5, 2.0), Capsule(0.3, 1.0)], ids=lambda f: f.kind
)
def test_native_solids_are_contained(field: Box | Sphere | Cylinder | Capsule) -> None:
    part = Part(field, (1, 2, 3), (0.6, 0.8, 0, 0))
    found = spheres_for(Link("a", np.eye(4), (), (), (), (part,)), None, 10, "around")
    rng = np.random.default_rng(0)
    local = rng.uniform(-1.6, 1.6, (200_000, 3)).astype(np.float32)
    within = local[
        np.asarray(dataclasses.replace(part, translation=(0, 0, 0), rotation=(1, 0, 0, 0)).distance(local))
        <= 0
    ]
    placed = within.astype(float) @ _turn().T + (1, 2, 3)
    assert outside_of_balls(placed, found.balls).max() <= 0
    assert found.sticking_out == 0


def _turn() -> np.ndarray:
    """Of the quaternion (.6, .8, 0, 0), about x."""
    c, s = 0.6**2 - 0.8**2, 2 * 0.6 * 0.8
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def test_numbers_for_curobo_are_numbers_in_yaml_however_small() -> None:
    balls = np.array([[1e-5, -2.5e-7, 3.0, 1e-4], [0.0, 1e6, -1.0, 12345.678]])
    text = curobo([LinkSpheres("tip: 1", balls, 0, 0, (0, 0, 0), None)])
    read = yaml.safe_load(text)["collision_spheres"]["tip: 1"]
    assert all(isinstance(v, float) for each in read for v in (*each["center"], each["radius"]))
    assert np.allclose([[*each["center"], each["radius"]] for each in read], balls, rtol=1e-5)


@pytest.mark.usefixtures("few_cells")
def test_the_json_holds_the_same_spheres_and_errors(tmp_path: Path) -> None:
    result = collide(urdf(tmp_path / "in"), CollideOptions(spheres=3, kinds=("box",), max_parts=1))
    save(result, tmp_path / "out")
    read = yaml.safe_load((tmp_path / "out" / "pair.urdf.spheres.yml").read_text())["collision_spheres"]
    found = json.loads((tmp_path / "out" / "pair.urdf.spheres.json").read_text())
    assert [*found] == [*read] == ["base", "arm"]
    for link, spheres in read.items():
        assert [each["origin"] for each in found[link]["spheres"]] == [each["center"] for each in spheres]
        assert [each["radius"] for each in found[link]["spheres"]] == [each["radius"] for each in spheres]
    assert 0 <= found["arm"]["best"] <= found["arm"]["mean"] <= found["arm"]["worst"] < 0.4
    with pytest.raises(SettingError, match="spheres: expected a number from 1"):
        CollideOptions(spheres=0)


@pytest.mark.usefixtures("few_cells")
def test_what_is_asked_for_in_one_link_is_said_in_the_singular(tmp_path: Path) -> None:
    said: list[str] = []
    path = tmp_path / "native.urdf"
    path.write_text(NATIVE)
    collide(open_robot(path), CollideOptions(spheres=16), told=said.append)
    assert "ball: 1 sphere" in said


def test_a_ball_around_one_point_leaves_the_others_their_volume() -> None:
    balls = np.array([[0, 0, 0, 1.0], [3, 0, 0, 0.0], [5, 0, 0, 1e-9]])
    assert balls_solid(balls).volume() == pytest.approx(4 / 3 * np.pi, rel=1e-6)
