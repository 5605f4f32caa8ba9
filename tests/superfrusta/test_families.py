"""Fits with fewer parameters: what a family does not have stays switched off through every stage."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from partwright.errors import SettingError
from partwright.fields.columns import SIZE, Column
from partwright.methods import FitRequest, Fitted, Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.families import FAMILIES, locked_values, with_locked_values
from tests.superfrusta.meshes import half_torus, table
from tests.superfrusta.rows import row


@cache
def draft(shape: Shape, **changes) -> Fitted:
    settings = Settings.for_quality("draft", cycles=2, **changes)
    return FitRequest(shape, settings, Run(threads=1)).fitted()


@pytest.fixture(scope="module")
def arc() -> Shape:
    """A shape that every parameter of a SuperFrustum helps with, and that takes several parts without."""
    return load_shape(half_torus())


@pytest.mark.parametrize("family", ["superprimitive", "cuboid"])
def test_every_part_of_a_fit_belongs_to_the_family(arc: Shape, family) -> None:
    parts = draft(arc, family=family).assembly.parts
    for column, value in FAMILIES[family].items():
        assert {getattr(part.field, column.name.lower()) for part in parts} == {value}
    assert any(part.blend > 0 for part in parts)


def test_the_whole_family_needs_fewer_parts_than_cuboids(arc: Shape) -> None:
    assert len(draft(arc).assembly) < len(draft(arc, family="cuboid").assembly)


def test_cuboids_are_enough_for_a_table() -> None:
    fitted = draft(load_shape(table()), family="cuboid")
    assert len(fitted.assembly) <= 7
    assert fitted.history[-1]["iou"] > 0.97


@pytest.mark.heavy
def test_plain_unions_do_not_blend(arc: Shape) -> None:
    parts = draft(arc, family="cuboid", smooth=False).assembly.parts
    assert len(parts) > 1
    assert {part.blend for part in parts} == {0.0}


def test_held_values_replace_others_and_make_starts_equal() -> None:
    rows = np.array([row(), row(), row(size=(1, 2, 1))], np.float32)
    rows[:, Column.BULGE] = (0.2, 0.6, 0.4)
    left = with_locked_values(rows, locked_values("superprimitive", smooth=True))
    np.testing.assert_array_equal(left[:, SIZE], rows[[0, 2], SIZE])
    assert (left[:, Column.BULGE] == 0).all()
    assert rows[0, Column.BULGE] == np.float32(0.2)
    np.testing.assert_array_equal(with_locked_values(rows, locked_values("superfrustum", smooth=True)), rows)
    rows[:, Column.BLEND] = 0.1
    plain = with_locked_values(rows, locked_values("superfrustum", smooth=False))
    assert (plain[:, Column.BLEND] == 0).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"family": "sphere"}, "superfrustum, superprimitive, cuboid"),
        ({"family": "cuboid", "optimiser": "adam"}, "moves all parameters"),
        ({"smooth": False, "optimiser": "adam"}, "moves all parameters"),
    ],
)
def test_settings_name_what_cannot_be(changes, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        Settings(**changes)
