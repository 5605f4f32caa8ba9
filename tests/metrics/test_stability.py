"""Curves whose structure is known by hand."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part
from partwright.errors import SettingError
from partwright.fields import Box
from partwright.metrics.stability import FINEST, nesting, plateaus, stability


def bar(name: str, start: float, end: float, parent: str | None = None) -> Part:
    """A bar of section 1 from x = start to x = end."""
    metadata = {"parent": parent} if parent else {}
    middle = ((start + end) / 2, 0.0, 0.0)
    return Part(Box((end - start, 1.0, 1.0)), middle, name=name, metadata=metadata)


HALVES = Assembly((bar("left", 0, 4, "all"), bar("right", 4, 8, "all")))
QUARTERS = Assembly(
    (bar("a", 0, 2, "left"), bar("b", 2, 4, "left"), bar("c", 4, 6, "right"), bar("d", 6, 8, "right"))
)


def test_parts_that_split_in_place_nest() -> None:
    assert nesting(QUARTERS, HALVES) == 1.0


def test_a_part_across_a_border_nests_as_far_as_it_keeps_to_its_side() -> None:
    """Of 8 units of bar, the one from 4 to 5 changes sides."""
    shifted = Assembly((bar("a", 0, 5, "left"), bar("b", 5, 8, "right")))
    assert nesting(shifted, HALVES) == pytest.approx(7 / 8, abs=0.03)


@settings(max_examples=10)
@given(scale=st.floats(1e-3, 1e3), x=st.floats(-50, 50))
def test_nesting_does_not_change_with_size_and_place(scale: float, x: float) -> None:
    shifted = Assembly((bar("a", 0, 5, "left"), bar("b", 5, 8, "right")))
    moved = [each.translated((x, 0.0, 0.0)).scaled(scale) for each in (shifted, HALVES)]
    assert nesting(*moved) == pytest.approx(7 / 8, abs=0.03)


def test_parents_must_exist() -> None:
    with pytest.raises(SettingError, match="no parent among left, right for a"):
        nesting(Assembly((bar("a", 0, 8, "middle"),)), HALVES)


def test_plateaus_by_hand() -> None:
    """3 parts are no better than 2, so they are never the fewest."""
    flat = plateaus([1, 2, 3, 4], [0.5, 0.9, 0.88, 0.92])
    assert [plateau.parts for plateau in flat] == [1, 2, 4]
    assert [plateau.lowest for plateau in flat] == pytest.approx([0.5, 0.1, 0.08])
    assert [plateau.highest for plateau in flat] == pytest.approx([1.0, 0.5, 0.1])
    assert flat[1].factor == pytest.approx(5.0)


def test_perfect_fits_do_not_last_for_ever() -> None:
    assert plateaus([1, 2], [1.0, 1.0]) == plateaus([1], [1.0])
    assert plateaus([1], [1.0])[0].factor == pytest.approx(1 / FINEST)
    with pytest.raises(SettingError, match="any IoU"):
        plateaus([1], [0.0])


def test_the_longest_plateau_names_the_structure() -> None:
    whole = Assembly((bar("all", 0, 8),))
    found = stability([QUARTERS, HALVES, whole], [0.95, 0.94, 0.4])
    assert found.nesting == 1.0
    assert [plateau.parts for plateau in found.plateaus] == [1, 2, 4]
    assert found.longest.parts == 2
    assert found.longest.factor == pytest.approx(10.0)


def test_a_curve_of_one_says_nothing_against_it() -> None:
    assert stability([Assembly((bar("all", 0, 8),))], [0.4]).nesting == 1.0
    assert stability([HALVES, whole := Assembly((bar("all", 0, 8),))], [0.6, 0.55]).longest.parts == 2
    assert stability([whole], [0.55]).longest.parts == 1
    with pytest.raises(SettingError, match="an IoU for each"):
        stability([HALVES], [])
