"""What is odd about a shape is told by the part and the number that it is odd by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from partwright.datasets import family_check
from partwright.datasets.family_check import LEFT_OUT, ODD, check_family, write_check
from partwright.datasets.family_names import copied_names, missing, rare_parts
from partwright.datasets.poses import Poses, average_poses
from partwright.datasets.prepared import PreparedFamily, PreparedShape, write_family
from partwright.datasets.preparing import Refused
from tests.partsdf.lamps import PARTS, lamp

COUNT = 20


def family_of(folder: Path, shapes: list[PreparedShape]) -> PreparedFamily:
    present = np.array([shape.present.astype(bool) for shape in shapes])
    average = average_poses(present, [shape.poses for shape in shapes])
    return write_family(folder, "lamps", PARTS, [(shape, "train") for shape in shapes], average)


@pytest.fixture(scope="module")
def plain() -> list[PreparedShape]:
    return [lamp(f"lamp{i:02d}", i, count=1000) for i in range(COUNT)]


def with_pose(shape: PreparedShape, part: int, **rows: np.ndarray) -> PreparedShape:
    arrays = {key: getattr(shape.poses, key).copy() for key in ("translation", "rotation", "scale")}
    for key, row in rows.items():
        arrays[key][part] = row
    return replace(shape, poses=Poses(**arrays))


def test_a_family_in_which_all_is_well_has_no_findings(plain: list[PreparedShape], tmp_path: Path) -> None:
    family = family_of(tmp_path / "f", plain)
    assert check_family(family) == []
    write_check(tmp_path / "check.md", family, [])
    assert "Nothing stands out." in (tmp_path / "check.md").read_text()


def test_what_was_not_read_is_told_and_harmless_repairs_are_not(
    plain: list[PreparedShape], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crossing = "the surface passes through itself"
    about = {
        "repairs": ["left out 2 loose flat sheets", "merged 3 vertices", crossing],
        "unread": ["took 1 body with morph targets without them"],
    }
    monkeypatch.setattr(family_check, "read_about", lambda path: about if path.stem == "lamp03" else {})
    findings = check_family(family_of(tmp_path / "f", plain))
    assert [(one.shape, one.severity, one.text) for one in findings] == [
        ("lamp03", ODD, crossing),
        ("lamp03", ODD, "took 1 body with morph targets without them"),
    ]


def test_each_odd_shape_is_told_by_part_and_number(plain: list[PreparedShape], tmp_path: Path) -> None:
    shapes = list(plain)
    shapes[1] = replace(shapes[1], present=np.array([1, 1, 0], np.uint8))
    shapes[2] = with_pose(shapes[2], 2, scale=3 * np.median([s.scale[2] for s in plain], axis=0))
    shapes[3] = with_pose(shapes[3], 2, translation=shapes[3].translation[2] + [0, 0.5, 0])
    turned = np.array([np.cos(np.pi / 6), 0, 0, np.sin(np.pi / 6)], np.float32)
    shapes[4] = with_pose(shapes[4], 0, rotation=turned)
    # The ball without its equator: two pieces.
    middle = shapes[5].vertices[shapes[5].faces].mean(axis=1)[:, 2] - shapes[5].translation[1, 2]
    kept = (shapes[5].label != 1) | (np.abs(middle) > 0.1)
    shapes[5] = replace(shapes[5], faces=shapes[5].faces[kept], label=shapes[5].label[kept])
    for p in range(3):
        away = shapes[6].translation[p] + np.array([0, 0, 0.9], np.float32)
        shapes[6] = with_pose(shapes[6], p, translation=away)
    family = family_of(tmp_path / "f", shapes)
    findings = check_family(family, [Refused("lamp99", "lamp99: is empty")])
    assert [(f.shape, f.text) for f in findings if not f.text.startswith("most parts")][:6] == [
        ("lamp99", "is empty"),
        ("lamp01", "no knob, which 19 of 20 shapes have"),
        ("lamp02", "knob is 3.0 times as large as usual"),
        ("lamp03", next(f.text for f in findings if f.shape == "lamp03")),
        ("lamp04", "plate is turned by 60 degrees against the others"),
        ("lamp05", "ball is in 2 pieces, in most shapes in 1"),
    ]
    assert any(f.shape == "lamp03" and f.text.startswith("knob lies 0.5") for f in findings)
    told = [f.text for f in findings if f.shape == "lamp06"]
    assert told[0] == STANDS
    assert told[1:] == ["plate, ball, knob lie 0.90 to 0.91 of 1.8 from the usual place"]
    assert {f.shape for f in findings} == {"lamp99", *(f"lamp0{i}" for i in range(1, 7))}
    assert [f.severity for f in findings] == [LEFT_OUT] + [ODD] * (len(findings) - 1)
    write_check(tmp_path / "check.md", family, findings)
    assert (
        "| lamp05 | look at it | ball is in 2 pieces, in most shapes in 1 |"
        in (tmp_path / "check.md").read_text().splitlines()
    )


def test_few_shapes_and_rare_parts_are_told(plain: list[PreparedShape], tmp_path: Path) -> None:
    shapes = [replace(s, present=np.array([1, 1, i < 2], np.uint8)) for i, s in enumerate(plain[:6])]
    texts = [f.text for f in check_family(family_of(tmp_path, shapes))]
    assert texts[0].startswith("6 shapes are few")
    assert texts[1] == "knob is in 2 of 6 shapes (lamp00, lamp01), too few to learn it"
    assert len(texts) == 2


def test_what_several_parts_have_in_common_is_one_line(plain: list[PreparedShape], tmp_path: Path) -> None:
    shapes = list(plain)
    shapes[1] = replace(shapes[1], present=np.array([1, 0, 0], np.uint8))
    shapes[2] = with_pose(shapes[2], 1, scale=3 * np.median([s.scale[1] for s in plain], axis=0))
    shapes[2] = with_pose(shapes[2], 2, scale=2 * np.median([s.scale[2] for s in plain], axis=0))
    for p in (1, 2):  # the plate is in another unit than they are
        shapes[3] = with_pose(shapes[3], p, scale=0.01 * np.median([s.scale[p] for s in plain], axis=0))
    assert [(f.shape, f.text) for f in check_family(family_of(tmp_path, shapes))] == [
        ("lamp01", "no ball, knob, which 19 of 20 shapes have"),
        ("lamp02", "ball, knob are 2.0 to 3.0 times as large as usual"),
        (
            "lamp03",
            "most of its parts are many times too small against the rest: they may be in another length unit",
        ),
        ("lamp03", "ball, knob are 99.2 to 100.8 times as small as usual"),
    ]


STANDS = "most parts lie elsewhere: it may stand otherwise than the others"


def test_a_small_part_does_not_hide_that_the_shape_stands_otherwise(
    plain: list[PreparedShape], tmp_path: Path
) -> None:
    shapes = list(plain)
    for p in range(3):
        away = shapes[1].translation[p] + np.array([0, 0, 0.9], np.float32)
        shapes[1] = with_pose(shapes[1], p, translation=away)
    shapes[1] = with_pose(shapes[1], 2, scale=0.05 * np.median([s.scale[2] for s in plain], axis=0))
    told = [f.text for f in check_family(family_of(tmp_path, shapes))]
    assert told == [
        STANDS,
        "plate, ball, knob lie 0.86 to 0.97 of 1.8 from the usual place",
        "knob is 20.0 times as small as usual",
    ]


def test_thin_parts_are_not_in_another_unit(plain: list[PreparedShape], tmp_path: Path) -> None:
    shapes = list(plain)
    for p in (1, 2):
        usual = np.median([s.scale[p] for s in plain], axis=0)
        shapes[1] = with_pose(shapes[1], p, scale=usual * [1, 1, 0.05])
    told = [f.text for f in check_family(family_of(tmp_path, shapes))]
    assert told == ["ball, knob are 19.6 to 20.0 times as small as usual"]


def test_a_part_that_comes_with_others_is_missed_where_those_are() -> None:
    """Half of the shapes have legs at all; those that have one have both."""
    present = np.array([[1, i < 8, i < 8] for i in range(16)], bool)
    present[3, 2] = False
    parts = ("seat", "leg_left", "leg_right")
    assert missing(parts, present, 0) == missing(parts, present, 1) == []
    assert missing(parts, present, 2) == [(3, "no {parts}, which 7 of the 8 shapes with leg_left have")]


def test_a_name_with_a_number_is_a_copys_unless_many_shapes_have_it() -> None:
    parts = ("leg", "leg.001", "wheel_1", "leg_2")
    present = np.ones((20, 4), bool)
    present[:, 1] = False
    present[4] = (False, True, True, True)
    present[5, 1] = True
    told = [copied_names(parts, present, i) for i in range(20)]
    assert [i for i, lines in enumerate(told) if lines] == [4, 5]  # leg_2 is in all
    assert told[4] == [
        "leg.001 and no leg: a node's name that came twice, or a copy's; name it as the other shapes do"
    ]
    assert told[5][0].startswith("leg.001 beside leg: ")
    assert rare_parts(parts, [f"s{i}" for i in range(20)], present) == [
        "leg.001 is in 2 of 20 shapes (s4, s5), too few to learn it"
    ]
