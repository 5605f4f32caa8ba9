"""What the shapes promise: to contain, to lie within, to be near, to be few."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, OpType

from partwright.errors import SettingError
from partwright.robots import CollideOptions, collide, save
from partwright.robots.containment import outside_of, shape_solid
from partwright.robots.solids import Solids
from tests.robots.robots import mjcf, urdf

KINDS = ["box", "cylinder", "sphere", "capsule", "ellipsoid", "hull"]


@pytest.mark.parametrize("kind", KINDS)
def test_enclosing_shapes_contain_every_point_of_the_visual_mesh(tmp_path: Path, kind: str) -> None:
    """Fresh points, by distances of the shapes' own kind; the visual L is turned and moved."""
    options = CollideOptions(enclose=True, kinds=(kind,), max_parts=6)
    result = collide(mjcf(tmp_path), options)
    base = next(link for link in result.robot.links if link.name == "base")
    target = Solids().target(base, base.visuals)
    points = target.samples(50_000, seed=12345)
    outside = np.min([outside_of(shape, points) for shape in result.shapes["base"]], axis=0)
    assert outside.max() <= 0
    report = next(link for link in result.links if link.link == "base")
    assert report.stands_for == "visual"
    assert report.sticking_out == 0
    assert report.missing < 2e-3  # facets of round shapes lie within them
    assert {shape.kind for shape in result.shapes["base"]} == {kind}


@pytest.mark.parametrize("kind", KINDS)
def test_shapes_inside_reach_nowhere_beyond_the_mesh(tmp_path: Path, kind: str) -> None:
    result = collide(mjcf(tmp_path), CollideOptions(inside=True, kinds=(kind,)))
    base = next(link for link in result.robot.links if link.name == "base")
    solid = Solids().target(base, base.collisions).solid
    for shape in result.shapes["base"]:
        own = shape_solid(shape)
        assert (own - solid).volume() <= 1e-6 * own.volume()
    report = next(link for link in result.links if link.link == "base")
    assert report.extra < 1e-6
    assert report.missing < (0.01 if kind in ("box", "hull") else 0.6)


def test_a_tolerance_tells_how_many_shapes_there_are() -> None:
    """Without one, more are spent as long as each saves much."""
    assert CollideOptions().worth is not None
    for told in ({"tolerance": "2%"}, {"enclose": True}, {"inside": True}):
        assert CollideOptions(**told).worth is None


def test_a_tighter_tolerance_comes_nearer_with_more_shapes(tmp_path: Path) -> None:
    path = urdf(tmp_path)
    ring = trimesh.creation.annulus(0.4, 0.5, 0.2, sections=64)
    ring.apply_translation((0, 0, 5))  # clear of the base
    ring.export(tmp_path / "meshes" / "rod.stl")
    found = []
    for tolerance in ("60mm", "10mm"):
        result = collide(path, CollideOptions(tolerance=tolerance, kinds=("hull",)))
        found.append(next(link for link in result.links if link.link == "arm"))
    assert found[0].count < found[1].count
    assert found[1].extra < found[0].extra
    assert found[1].deviation <= 0.0101
    assert found[1].count <= 16


def test_native_shapes_alone_are_taken_to_the_number_allowed(tmp_path: Path) -> None:
    """No hull where none is wanted, whatever the tolerance; and the report says what that costs."""
    path = urdf(tmp_path)
    cone = trimesh.creation.cone(0.5, 1.0, sections=48)
    cone.export(tmp_path / "meshes" / "rod.stl")
    errors = []
    for most in (1, 4):
        result = collide(path, CollideOptions(kinds=("cylinder",), max_parts=most))
        assert [shape.kind for shape in result.shapes["arm"]] == ["cylinder"] * len(result.shapes["arm"])
        assert len(result.shapes["arm"]) <= most
        arm = next(link for link in result.links if link.link == "arm")
        errors.append(arm.missing + arm.extra)
    assert errors[1] < 0.7 * errors[0]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"enclose": True, "inside": True}, "contradict"),
        ({"tolerance": "wide"}, "expected a length"),
        ({"tolerance": "0mm"}, "expected a length"),
        ({"max_parts": 0}, "at least 1"),
        ({"extra": -1}, "share of the volume"),
    ],
)
def test_options_that_make_no_sense(given: dict, words: str) -> None:
    with pytest.raises(SettingError, match=words):
        CollideOptions(**given)


def test_kinds_that_a_format_lacks(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"has no 'ellipsoid'; expected some of box, cylinder, sphere"):
        collide(urdf(tmp_path), CollideOptions(kinds=("ellipsoid",)))


@pytest.mark.parametrize("enclose", [False, True])
def test_spheres_fill_or_contain_a_link_and_more_do_it_better(tmp_path: Path, enclose: bool) -> None:
    path = urdf(tmp_path)
    sizes = []
    for count in (1, 8):
        result = collide(path, CollideOptions(enclose=enclose, spheres=count, kinds=("box",), max_parts=1))
        rod = result.spheres["arm"]
        assert len(rod) <= count
        sizes.append(4 / 3 * np.pi * (rod[:, 3] ** 3).sum())
        arm = next(link for link in result.robot.links if link.name == "arm")
        target = Solids().target(arm, arm.collisions)
        if enclose:
            points = target.samples(20_000, seed=77)
            inside = (np.linalg.norm(points[:, None] - rod[None, :, :3], axis=2) <= rod[:, 3]).any(axis=1)
            assert inside.mean() > 0.999
        else:
            balls = [Manifold.sphere(r, 32).translate((x, y, z)) for x, y, z, r in rod.tolist()]
            union = Manifold.batch_boolean(balls, OpType.Add)
            assert union.volume() == pytest.approx(target.solid.volume(), rel=0.02)
    if enclose:
        assert sizes[1] < 0.7 * sizes[0]


def test_spheres_are_written_for_curobo_and_as_json(tmp_path: Path) -> None:
    result = collide(urdf(tmp_path / "in"), CollideOptions(spheres=3, kinds=("box",), max_parts=1))
    save(result, tmp_path / "out")
    text = (tmp_path / "out" / "pair.urdf.spheres.yml").read_text()
    assert text.startswith('collision_spheres:\n  "base":\n    - center: [')
    found = json.loads((tmp_path / "out" / "pair.urdf.spheres.json").read_text())
    assert (
        len(found["arm"]["spheres"])
        == len(result.spheres["arm"])
        == text.count("radius") - len(found["base"]["spheres"])
    )
    assert 0 <= found["arm"]["best"] <= found["arm"]["mean"] <= found["arm"]["worst"] < 0.3
    with pytest.raises(SettingError, match="spheres: expected a number from 1"):
        CollideOptions(spheres=0)
