"""Groups that are repeated: found, edited, described and written once."""

from __future__ import annotations

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, copies_of, line, load_assembly, mirrored, ring
from partwright.assembly.editing import with_numbers
from partwright.assembly.motion import Motion
from partwright.assembly.repeated_groups import alike_leaves, move_between, parts_once, repeats
from partwright.cli.main import main
from partwright.errors import ParameterError
from partwright.export import export
from partwright.fields import Box, Cylinder, Extrusion, Profile, Revolution
from partwright.meshing import mesh_assembly
from tests.export.test_openscad import rendered

FOOT = Assembly(
    (Part(Cylinder(6, 10), (30, 20, -5), name="foot"), Part(Cylinder(2, 30), (30, 20, -5), name="hole")),
    "difference",
)
RIB = Assembly((Part(Box((2, 4, 8)), (0, 10, 8), name="rib"), Part(Box((2, 2, 2)), (0, 10, 13), name="tip")))


def table() -> Assembly:
    """A plate of 80 x 60 x 6 on four feet with holes, and three ribs of two pieces in a row."""
    feet = copies_of(FOOT, ring(4))
    ribs = copies_of(RIB, line(3, (12, 0, 0)))
    return Assembly((Part(Box((80, 80, 6)), (0, 0, 3), name="plate"), FOOT, *feet, RIB, *ribs), unit="mm")


def test_copies_are_found_by_their_fields_and_places() -> None:
    whole = table().transformed(Similarity(2.0, (0.5, 0.5, 0.5, 0.5), (3, -8, 1)))
    feet, ribs = repeats(whole)
    assert (feet.first, feet.copies, ribs.first, ribs.copies) == (1, (2, 3, 4), 5, (6, 7))
    move = move_between(FOOT, copies_of(FOOT, ring(4))[0])
    assert move is not None
    np.testing.assert_allclose(move(np.array([30.0, 20, -5])), [-20, 30, -5], atol=1e-12)
    moved = FOOT.replace_part("hole", replace(FOOT["hole"], translation=(30, 20.1, -5)))
    assert move_between(FOOT, moved) is None
    assert {name for name, _ in alike_leaves(whole)["hole_02"]} == {"hole", "hole_03", "hole_04"}


def test_groups_within_repeated_groups_are_all_alike() -> None:
    pair = Assembly((RIB, *copies_of(RIB, line(2, (5, 0, 0)))))
    whole = Assembly((pair, *copies_of(pair, ring(3))))
    found = alike_leaves(whole)["rib"]
    assert len(found) == 5
    for name, move in found:
        np.testing.assert_allclose(
            move(np.array(whole["rib"].translation)), whole[name].translation, atol=1e-9
        )


def test_one_edit_changes_all_copies_and_keeps_what_follows() -> None:
    edited = with_numbers(table(), {"hole.diameter": 5, "foot_03.x": -33})
    holes = [part for part in edited.assembly.parts if part.name.startswith("hole")]
    assert [part.field for part in holes] == [Cylinder(2.5, 30)] * 4
    assert edited.assembly["foot"].translation == pytest.approx((33, 20, -5))
    assert edited.assembly["foot_02"].translation == pytest.approx((-20, 33, -5))
    assert "hole_02, hole_03, hole_04, copies of hole, change with it" in edited.followed
    alone = with_numbers(table(), {"hole.diameter": 5}, alone=True).assembly
    assert [alone[f"hole{k}"].field.radius for k in ("", "_02")] == [2.5, 2]  # type: ignore[attr-defined]
    assert len(repeats(alone)[0].copies) == 2  # the other three go on being one another's
    named = with_numbers(table(), {"foot*.x": 5}).assembly
    assert [named[f"foot{k}"].translation[0] for k in ("", "_02", "_03", "_04")] == pytest.approx([5] * 4)
    taller = with_numbers(table(), {"foot_02.height": 12}).assembly
    assert {taller[f"foot{k}"].field.height for k in ("", "_02", "_03", "_04")} == {12}  # type: ignore[attr-defined]


def test_a_description_and_a_file_say_and_keep_them(tmp_path: Path) -> None:
    text = table().describe()
    assert "├─ difference, 4 times\n" in text
    assert "└─ union, 3 times\n" in text
    assert text.count("cylinder") == 2
    table().save(tmp_path / "t.json")
    assert load_assembly(tmp_path / "t.json") == table()


def test_counts_are_of_each_once_and_of_every_copy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert [part.name for part in parts_once(table())] == ["plate", "foot", "hole", "rib", "tip"]
    assert len(table()) == 15
    table().save(tmp_path / "t.json")
    assert main(["describe", str(tmp_path / "t.json")]) == 0
    assert capsys.readouterr().out.endswith("\n5 parts, 15 with every copy\n")


HANDED = Assembly(
    (
        Part(Extrusion(Profile([(0, 0), (9, 0), (5, 4), (0, 3)]), 6, 5), (12, 2, 3), name="block"),
        Part(Cylinder(1, 9), (14, 4, 3), name="hole"),
        Part(Revolution(Profile([(1, 0), (2, 0), (2, 1)]), 100), (13, 3, 6), name="groove"),
    ),
    "difference",
)


def pair(axis: str = "y") -> Assembly:
    """A base, and on it two blocks and their two mirror images."""
    blocks = Assembly((HANDED, *copies_of(HANDED, line(2, (0, 12, 0)))))
    images = mirrored(blocks, axis, -1, suffix="_left")
    base = Part(Box((60, 60, 2)), (0, 0, -1), name="base")
    return Assembly((base, *blocks.children, *images.children), unit="mm")


def test_mirror_images_are_told_edited_and_counted_with_what_they_are_images_of() -> None:
    whole = pair()
    (found,) = repeats(whole)
    assert (found.copies, found.images) == ((2,), (3, 4))
    assert "difference, 4 times, 2 mirrored" in whole.describe()
    assert [part.name for part in parts_once(whole)] == ["base", "block", "hole", "groove"]
    points = np.random.default_rng(2).uniform(-30, 30, (2000, 3))
    for values in ({"hole.diameter": 3}, {"block.height": 8}, {"hole.x": 15}, {"groove.angle": 140}):
        edited = with_numbers(whole, values).assembly
        (still,) = repeats(edited)
        assert (still.copies, still.images) == ((2,), (3, 4))
        ((name, value),) = values.items()
        by_image = with_numbers(whole, {name.replace(".", "_left."): value}).assembly
        np.testing.assert_allclose(edited.distance(points), by_image.distance(points), atol=1e-5)
    assert with_numbers(whole, {"hole.y": 5}).assembly["hole_left"].translation[1] == pytest.approx(-7)
    assert by_image["groove"].field.angle == 140  # type: ignore[attr-defined]
    alone = with_numbers(whole, {"hole_left.diameter": 3}, alone=True).assembly
    assert [one.images for one in repeats(alone)] == [(4,)]


def test_motions_compose_as_the_maps_that_they_are() -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(5, 3))
    one, two = (
        Motion(Similarity(1.0, tuple(rng.normal(size=4)), tuple(rng.normal(size=3))), m)
        for m in (True, False)
    )
    for first, then in ((one, two), (two, one), (one, one)):
        np.testing.assert_allclose((then @ first)(points), then(first(points)), atol=1e-12)
        np.testing.assert_allclose(first.inverse()(first(points)), points, atol=1e-12)
        np.testing.assert_allclose(
            first.linear @ points[0], first(points[0]) - first(np.zeros(3)), atol=1e-12
        )


def test_sources_draw_mirror_images_of_what_is_there_once(tmp_path: Path) -> None:
    whole = pair("x")
    solid = mesh_assembly(whole, 128)
    export(whole, tmp_path / "p.scad", facets=48)
    text = (tmp_path / "p.scad").read_text()
    assert text.count("mirror([pose[2], 0, 0])") == 1
    assert text.count("module ") == len(parts_once(whole))
    mesh = rendered(tmp_path / "p.scad")
    assert mesh.volume == pytest.approx(solid.volume, rel=5e-3)
    assert np.abs(whole.distance(mesh.vertices)).max() < 0.1
    pytest.importorskip("build123d")
    export(whole, tmp_path / "p.build123d.py")
    text = (tmp_path / "p.build123d.py").read_text()
    assert text.count("bd.mirror") == 1
    assert "left" not in text
    made = runpy.run_path(str(tmp_path / "p.build123d.py"))["assembly"]
    assert made.volume == pytest.approx(solid.volume, rel=5e-3)
    assert tuple(made.center()) == pytest.approx(solid.center_mass, abs=0.05)


def test_openscad_has_each_once(tmp_path: Path) -> None:
    export(table(), tmp_path / "t.scad", facets=24)
    text = (tmp_path / "t.scad").read_text()
    assert text.count("module ") == 5
    assert "for (pose = [[[0, 0, 0], [0, 0, 0]], [[12, 0, 0], [0, 0, 0]], [[24, 0, 0], [0, 0, 0]]])" in text
    mesh = rendered(tmp_path / "t.scad")
    assert mesh.volume == pytest.approx(mesh_assembly(table(), 256).volume, rel=5e-3)


def test_build123d_has_each_once(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    path = tmp_path / "t.build123d.py"
    export(table(), path)
    assert path.read_text().count("def ") == 5
    volume = 80 * 80 * 6 + 4 * math.pi * (36 - 4) * 10 + 3 * (2 * 4 * 6 + 8)
    assert runpy.run_path(str(path))["assembly"].volume == pytest.approx(volume, rel=1e-9)


def test_groups_that_are_intersected_are_not_drawn_in_a_loop(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    group = Assembly((Part(Box((4, 4, 4))), Part(Box((8, 1, 1)))))
    both = Assembly((group, *copies_of(group, [Similarity(translation=(1, 0, 0))])), "intersection")
    export(both, tmp_path / "a.build123d.py")
    made = runpy.run_path(str(tmp_path / "a.build123d.py"))["assembly"]
    assert made.volume == pytest.approx(3 * 16 + 2 * 2)
    export(both, tmp_path / "a.scad")
    assert "for (" not in (tmp_path / "a.scad").read_text()


def test_bad_patterns_are_named() -> None:
    with pytest.raises(ParameterError, match="scales by 2"):
        copies_of(Assembly((Part(Box((1, 1, 1))),)), [Similarity(2.0)])
    with pytest.raises(ParameterError, match="count"):
        line(1, (1, 0, 0))
    with pytest.raises(ParameterError, match=r"count: .* got 2\.5"):
        ring(2.5)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="axis"):
        ring(3, "w")
