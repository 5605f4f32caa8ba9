"""Groups that are repeated: found, edited, described and written once."""

from __future__ import annotations

import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, copies_of, line, load_assembly, ring
from partwright.assembly.numbers import with_numbers
from partwright.assembly.repeated_groups import alike_leaves, move_between, parts_once, repeats
from partwright.cli.main import main
from partwright.errors import ParameterError
from partwright.export import export
from partwright.fields import Box, Cylinder
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


def test_bad_patterns_are_named() -> None:
    with pytest.raises(ParameterError, match="count"):
        line(1, (1, 0, 0))
    with pytest.raises(ParameterError, match=r"count: .* got 2\.5"):
        ring(2.5)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="axis"):
        ring(3, "w")
