"""What the shapes promise: to contain, to lie within, to be near, to be few."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.errors import SettingError
from partwright.robots import CollideOptions, collide, link_processes
from partwright.robots.containment import outside_of, shape_solid
from partwright.robots.model import Shape
from partwright.robots.report import warnings
from partwright.robots.shaping import Wishes, shapes_for
from partwright.robots.solids import Solids, Target
from tests.robots.robots import mjcf, urdf

KINDS = ["box", "cylinder", "sphere", "capsule", "ellipsoid", "hull"]


def with_a_plain_tip(folder: Path) -> Path:
    """The robot whose base is an L: nothing is asked of its tip here, and a box costs less than a ball."""
    path = mjcf(folder)
    trimesh.creation.box((0.3, 0.3, 0.3)).export(folder / "assets" / "ball.stl")
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_enclosing_shapes_contain_every_point_of_the_visual_mesh(tmp_path: Path, kind: str) -> None:
    """Fresh points, by distances of the shapes' own kind; the visual L is turned and moved."""
    options = CollideOptions(enclose=True, kinds=(kind,), max_parts=6)
    result = collide(with_a_plain_tip(tmp_path), options)
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
    result = collide(with_a_plain_tip(tmp_path), CollideOptions(inside=True, kinds=(kind,), max_parts=12))
    base = next(link for link in result.robot.links if link.name == "base")
    solid = Solids().target(base, base.collisions).solid
    for shape in result.shapes["base"]:
        own = shape_solid(shape)
        assert (own - solid).volume() <= 1e-6 * own.volume()
    report = next(link for link in result.links if link.link == "base")
    assert report.extra < 1e-6
    assert report.missing < (0.01 if kind in ("box", "hull") else 0.6)


def test_links_of_the_same_mesh_have_the_same_shapes_which_are_made_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the legs of a walker; not those of the mesh in another place, or mirrored."""
    made: list[str] = []

    def counted(name: str, *rest: Any) -> list[Shape]:
        made.append(name)
        return shapes_for(name, *rest)

    monkeypatch.setattr(link_processes, "shapes_for", counted)
    path = urdf(tmp_path)
    legs = "".join(
        f"""<link name="{name}"><collision><geometry>
              <mesh filename="meshes/ell.stl" scale="{scale}"/>
            </geometry></collision></link>
            <joint name="{name}" type="fixed">
              <parent link="base"/><child link="{name}"/><origin xyz="{place} 9 0"/>
            </joint>"""
        for name, scale, place in (("left", "1 1 1", 0), ("right", "1 -1 1", 9), ("front", "1 1 1", 18))
    )
    path.write_text(path.read_text().replace("</robot>", f"{legs}</robot>"))
    result = collide(path, CollideOptions(kinds=("hull",), spheres=2))
    shapes, balls = result.shapes, {each.link: each.balls for each in result.spheres}
    assert balls["front"] is balls["left"] is not balls["right"]
    assert made == ["base", "arm", "left", "right"]
    assert [shape.name for shape in shapes["front"]] == ["front_collision_1", "front_collision_2"]
    for one, other in zip(shapes["left"], shapes["front"], strict=True):
        assert np.array_equal(one.mesh.vertices, other.mesh.vertices)


def test_inside_of_a_box_with_a_dent_that_hardly_counts(tmp_path: Path) -> None:
    """Its hull is off by less than any tolerance, and yet outside of it."""
    path = urdf(tmp_path)
    box = trimesh.creation.box((1, 1, 1)).subdivide().subdivide()
    top = np.flatnonzero(np.all(np.isclose(box.vertices, (0, 0, 0.5)), axis=1))
    box.vertices[top, 2] -= 0.004
    box.apply_translation((0, 0, 5)).export(tmp_path / "meshes" / "rod.stl")
    result = collide(path, CollideOptions(inside=True, kinds=("hull",)))
    (shape,) = result.shapes["arm"]
    assert shape.mesh.vertices[:, 2].max() < 5.497
    arm = next(link for link in result.links if link.link == "arm")
    assert arm.extra < 1e-8
    assert arm.missing < 0.02


def test_a_warning_advises_what_would_help(tmp_path: Path) -> None:
    """More shapes where they are used up, else a smaller tolerance."""
    path = urdf(tmp_path)
    link = collide(path, CollideOptions(max_parts=1, kinds=("hull",))).links[0]
    assert link.count == link.most == 1
    (warning,) = warnings([link])
    assert warning.endswith("more shapes (--max-parts) would be nearer")
    (warning,) = warnings([dataclasses.replace(link, most=48)])
    assert warning.endswith("a smaller --tolerance would be nearer")


def test_a_tolerance_tells_how_many_shapes_there_are() -> None:
    """Without one, more are spent as long as each saves much."""
    assert CollideOptions().worth is not None
    for told in ({"tolerance": "2%"}, {"enclose": True}, {"inside": True}):
        assert CollideOptions(**told).worth is None


def test_native_solids_alone_are_not_stacked_thinner_and_thinner(tmp_path: Path) -> None:
    """Each has to save some volume, where no tolerance asks for more; the report says what is not kept."""
    path = urdf(tmp_path)
    cone = trimesh.creation.cone(0.5, 1.0, sections=12)
    cone.apply_translation((0, 0, 5))  # clear of the base
    cone.export(tmp_path / "meshes" / "rod.stl")
    found = {}
    for tolerance in (None, "0.1%"):
        options = CollideOptions(kinds=("box",), tolerance=tolerance, max_parts=32)
        result = collide(path, options)
        found[tolerance] = next(link for link in result.links if link.link == "arm")
    few, many = found[None], found["0.1%"]
    assert 4 <= few.count <= 24 < many.count == 32
    assert few.missing + few.extra < many.missing + many.extra + 0.05
    assert few.deviation > few.tolerance
    (warning,) = [line for line in warnings([few]) if few.link in line]
    assert "hulls (--kinds) would be nearer" in warning
    assert f"{1000 * few.deviation:.1f} mm off at (" in warning


def test_a_warning_says_where_a_link_is_farthest_off(tmp_path: Path) -> None:
    """One hull closes a cup: in the middle of its mouth the hull is as far off as the wall."""
    path = urdf(tmp_path)
    cup = trimesh.boolean.difference(
        [
            trimesh.creation.cylinder(0.5, 1.0, sections=32),
            trimesh.creation.cylinder(0.4, 1.0, sections=32).apply_translation((0, 0, 0.2)),
        ]
    )
    cup.apply_translation((2, 0, 7)).export(tmp_path / "meshes" / "rod.stl")
    result = collide(path, CollideOptions(max_parts=1))
    link = next(link for link in result.links if link.link == "arm")
    assert link.count == 1
    assert not link.farthest.missing
    away = cup.nearest.on_surface([link.farthest.at])[1][0]
    assert abs(away - link.deviation) < 2e-3
    assert link.deviation > 0.3
    (warning,) = [line for line in warnings([link]) if "mm off at (" in line]
    assert "where they add something" in warning
    assert link.to_dict()["max_deviation_at"] == pytest.approx(link.farthest.at, abs=1e-5)


def test_a_speck_far_from_all_else_is_not_lost(tmp_path: Path) -> None:
    """It is finer than what the search for cuts rounds off, and all that there is at its place."""
    path = urdf(tmp_path)
    balls = [trimesh.creation.icosphere(6, 0.3).apply_translation((x, 0, 0)) for x in (-0.2, 0.2)]
    speck = trimesh.creation.box((1e-5, 2e-4, 2e-4)).apply_translation((0.9, 0.1, 0.0))
    both = trimesh.util.concatenate([trimesh.boolean.union(balls), speck])
    both.apply_translation((0, 0, 5)).export(tmp_path / "meshes" / "rod.stl")
    link = next(link for link in collide(path).links if link.link == "arm")
    assert link.deviation <= link.tolerance


def test_volume_that_was_asked_for_is_kept_however_many_shapes_it_takes(tmp_path: Path) -> None:
    """By default many shapes are made only where each saves enough; a stated --extra goes on."""
    path = urdf(tmp_path)
    thin = trimesh.creation.annulus(0.48, 0.5, 0.2, sections=128)
    thin.apply_translation((0, 0, 5)).export(tmp_path / "meshes" / "rod.stl")
    counts, errors = [], []
    for extra in (None, 0.02):
        result = collide(path, CollideOptions(max_parts=96, extra=extra))
        link = next(link for link in result.links if link.link == "arm")
        counts.append(link.count)
        errors.append(link.missing + link.extra)
    assert counts[0] <= 48 < counts[1]
    assert errors[1] < min(errors[0], 0.02)


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
    assert all(link.deviation <= link.tolerance for link in found)
    assert found[1].count <= 16


def test_a_link_is_held_to_the_tolerance_that_was_given(tmp_path: Path, monkeypatch) -> None:
    """Also where it was made finer, since it overlapped a neighbour."""
    asked = []

    def overlapping(*rest) -> list[tuple[str, str]]:
        return [("base", "arm")]

    def measured(name: str, target: Target, wishes: Wishes) -> list[Shape]:
        asked.append(wishes.tolerance)
        return shapes_for(name, target, wishes)

    monkeypatch.setattr(sys.modules["partwright.robots.collide"], "too_near", overlapping)
    monkeypatch.setattr(link_processes, "shapes_for", measured)
    result = collide(urdf(tmp_path), CollideOptions(tolerance="10mm"))
    assert {link.tolerance for link in result.links} == {0.01}
    assert min(asked) == max(asked) / 2 < 0.005


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
