"""One part in two, several in one, one more within a box: beside parts that stay as they are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.exchange import added, exchanged
from partwright.errors import ParameterError, SettingError
from partwright.fields import Box, Cylinder, Quadric, SuperFrustum
from partwright.meshing import mesh_assembly
from partwright.methods import METHODS, Run
from partwright.metrics import evaluate
from partwright.shapes import Shape, load_shape
from partwright.superfrusta.local_fits import LocalFit

TOP = Part(Box((80, 40, 10)), (0, 0, 40), name="top")
LEFT = Part(Box((10, 40, 40)), (-35, 0, 15), name="left")
RIGHT = Part(Box((10, 40, 40)), (35, 0, 15), name="right")
KNOB = Part(Cylinder(8, 20), (20, 0, 55), name="knob")
TABLE = Assembly((TOP, LEFT, RIGHT, KNOB), unit="mm").translated((100, 0, 0))


@pytest.fixture(scope="module")
def table() -> Shape:
    return load_shape(mesh_assembly(TABLE, 96), unit="mm")


def local(shape: Shape, assembly: Assembly, method: str = "superfrusta") -> LocalFit:
    return LocalFit(shape, assembly, METHODS[method].settings("draft"), Run())


def iou(assembly: Assembly, shape: Shape) -> float:
    return float(evaluate(assembly, shape, emd=False).iou)


def others_stay(before: Assembly, after: Assembly, *but: str) -> bool:
    return all(after[part.name] == part for part in before.parts if part.name not in but)


@pytest.mark.parametrize("method", ["superfrusta", "solids"])
def test_a_part_that_stands_for_two_is_split_between_them(table: Shape, method: str) -> None:
    both = Part(Box((80, 40, 40)), (100, 0, 15), name="legs")  # and all that is between them
    coarse = Assembly((TABLE["top"], TABLE["knob"], both), unit="mm")
    fine = local(table, coarse, method).split("legs")
    assert [part.name for part in fine.parts] == ["top", "knob", "legs", "legs_02"]
    assert others_stay(coarse, fine, "legs")
    assert iou(fine, table) > 0.95
    left, right = sorted((fine["legs"], fine["legs_02"]), key=lambda part: part.bounds()[0][0])
    assert left.bounds()[1][0] < 75
    assert right.bounds()[0][0] > 125


def test_two_halves_become_the_one_that_they_were(table: Shape) -> None:
    halves = (Part(Box((40, 40, 10)), (x, 0, 40), name=n) for x, n in ((80, "one"), (120, "two")))
    rest = [TABLE[name] for name in ("left", "right", "knob")]
    split = Assembly((*halves, *rest), unit="mm")
    whole = local(table, split).merge(["one", "two"])
    assert [part.name for part in whole.parts] == ["one", "left", "right", "knob"]
    assert others_stay(split, whole, "one", "two")
    assert iou(whole, table) > 0.97
    assert np.abs(np.array(whole["one"].bounds()) - [(60, -20, 35), (140, 20, 45)]).max() < 2


def test_what_is_missing_in_a_box_becomes_a_part_within_it(table: Shape) -> None:
    without = TABLE.without("knob")
    box = np.array([(105, -15, 40), (135, 15, 75)])
    whole = local(table, without).fill(box.ravel().tolist())
    (new,) = [part for part in whole.parts if part.name not in ("top", "left", "right")]
    assert others_stay(without, whole)
    assert iou(whole, table) > iou(without, table) + 0.01
    low, high = new.bounds()
    assert (low > box[0] - 1).all()
    assert (high < box[1] + 1).all()
    # The same from half of it: the part ends with the box.
    half = np.array([(105, -15, 40), (120, 15, 75)])
    low, high = local(table, without).fill(half.ravel().tolist()).parts[-1].bounds()
    assert high[0] < 121.5


def test_a_repeated_part_is_split_with_its_copies_and_a_hole_in_two() -> None:
    legs = Part(Cylinder(5, 40), (-30, 0, 0), name="leg", instances=(Similarity(translation=(60, 0, 0)),))
    foot = Part(Cylinder(9, 12), (-30, 0, -14), name="foot", instances=legs.instances)
    seat = Part(Box((90, 50, 14)), (0, 0, 24), name="seat")
    holes = [Part(Cylinder(6, 30), (x, 10, 24), name=f"hole_{n}") for n, x in (("a", -15), ("b", 15))]
    true = Assembly((Assembly((seat, legs, foot)), *holes), "difference")
    shape = load_shape(mesh_assembly(true, 96))
    coarse = true.without("foot").without("hole_b")
    slot = dataclasses.replace(coarse["hole_a"], field=Box((46, 12, 30)), translation=(0, 10, 24))
    coarse = coarse.replace_part("hole_a", slot)

    legs_split = local(shape, coarse).split("leg")
    assert legs_split["leg_02"].instances == legs.instances
    assert len(legs_split) == len(coarse) + 1
    assert iou(legs_split, shape) > iou(coarse, shape) + 0.02
    holes_split = local(shape, coarse).split("hole_a")
    assert holes_split.operation == "difference"
    assert [child.name for child in holes_split.children[1:]] == ["hole_a", "hole_a_02"]
    assert iou(holes_split, shape) > iou(coarse, shape) + 0.02
    with pytest.raises(SettingError, match="added and one that is taken away"):
        local(shape, coarse).merge(["seat", "hole_a"])
    with pytest.raises(SettingError, match="different copies"):
        local(shape, coarse).merge(["seat", "leg"])


def test_what_cannot_be_done_is_said(table: Shape) -> None:
    fit = local(table, TABLE)
    with pytest.raises(SettingError, match="no part is named 'arm'; the names are: top, left"):
        fit.split("arm")
    with pytest.raises(SettingError, match="at least two"):
        fit.merge(["top"])
    with pytest.raises(SettingError, match="lowest and its highest"):
        fit.fill([1, 2, 3])
    with pytest.raises(SettingError, match="lowest and its highest"):
        fit.fill([0, 0, 0, -1, 1, 1])
    with pytest.raises(SettingError, match="nothing of the shape"):
        fit.fill([200, 200, 200, 210, 210, 210])
    with pytest.raises(SettingError, match="nothing is missing"):
        fit.fill([61, -19, 36, 139, 19, 44])
    far = TABLE | Part(Box((5, 5, 5)), (300, 0, 0), name="far")
    with pytest.raises(SettingError, match="stands for nothing"):
        local(table, far).split("far")
    plane = TABLE | Part(Quadric.plane((0, 0, 1), 0), name="plane")
    with pytest.raises(SettingError, match="plane is of kind quadric"):
        local(table, plane).split("top")


def test_a_leaf_is_exchanged_in_every_kind_of_group() -> None:
    a, b, c = (Part(SuperFrustum((1, 1, 1)), (i, 0, 0), name=n) for i, n in enumerate("abc"))
    two = (dataclasses.replace(b, name=""), dataclasses.replace(c, name="c"))
    assert [p.name for p in exchanged(Assembly((a, b)), "a", two).children] == ["part_01", "c", "b"]
    cut = exchanged(a - b, "b", two)
    assert cut.operation == "difference"
    assert len(cut.children) == 3
    body = exchanged(a - b, "a", two)
    assert body.children[0] == Assembly(tuple(body.children[0].children))
    shared = exchanged(Assembly((a & b, c)), "b", [c])
    assert [p.name for p in shared.parts] == ["a", "c", "c_02"]
    assert added(a - b, c).children[0].operation == "difference"
    with pytest.raises(ParameterError, match="no part is named"):
        exchanged(Assembly((a,)), "b", two)
