"""Parts against labels, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part
from partwright.errors import SettingError
from partwright.fields import Box
from partwright.metrics.purity import owners, purity

indices = st.lists(st.integers(0, 4), min_size=1, max_size=40)


def test_parts_that_are_the_labels_are_pure_and_complete() -> None:
    label = np.array([0, 0, 0, 1, 1, 2])
    found = purity(2 - label, label)
    measured = (found.purity, found.completeness, found.parts_per_label, found.found, found.floor)
    assert measured == pytest.approx((1, 1, 1, 1, 0.5))


def test_one_part_over_all_is_complete_and_only_as_pure_as_the_largest_label() -> None:
    found = purity(np.zeros(10), np.array([0] * 7 + [1] * 3))
    assert found.purity == found.floor == pytest.approx(0.7)
    assert found.completeness == pytest.approx(1.0)
    assert found.found == 0.5


def test_a_label_in_equal_pieces_is_pure_and_incomplete() -> None:
    found = purity(np.arange(12) % 4, np.zeros(12))
    assert found.purity == pytest.approx(1.0)
    assert found.completeness == pytest.approx(1 / 4)
    assert found.parts_per_label == pytest.approx(4)


def test_a_mixed_table_by_hand() -> None:
    """Part 0 holds 3 of label a and 1 of b, part 1 holds 2 of a and 4 of b."""
    owner = np.repeat([0, 0, 1, 1], [3, 1, 2, 4])
    label = np.repeat([0, 1, 0, 1], [3, 1, 2, 4])
    found = purity(owner, label)
    assert found.purity == pytest.approx((3 + 4) / 10)
    assert found.completeness == pytest.approx((3 + 4) / 10)
    assert found.parts_per_label == pytest.approx((25 / 13 + 25 / 17) / 2)


def test_weights_count() -> None:
    found = purity(np.array([0, 0]), np.array([0, 1]), np.array([3.0, 1.0]))
    assert found.purity == pytest.approx(0.75)


@given(owner=indices, seed=st.integers(0, 99))
def test_bounds_and_independence_of_the_numbering(owner: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts, label = np.array(owner), rng.integers(0, 3, len(owner))
    found = purity(parts, label)
    assert found.floor - 1e-9 <= found.purity <= 1 + 1e-9
    assert 0 < found.completeness <= 1 + 1e-9
    assert 1 - 1e-9 <= found.parts_per_label <= len(np.unique(parts)) + 1e-9
    assert purity(10 - parts, 7 * label + 3).purity == pytest.approx(found.purity)
    swapped = purity(label, parts)
    assert swapped.purity == pytest.approx(found.completeness)
    assert swapped.completeness == pytest.approx(found.purity)


def test_owners_are_the_nearest_or_deepest_parts() -> None:
    pair = Assembly((Part(Box((2.0, 2.0, 2.0))), Part(Box((1.0, 1.0, 1.0)), (1.5, 0.0, 0.0))))
    points = np.array([[-3.0, 0, 0], [0.5, 0, 0], [1.9, 0, 0], [9.0, 0, 0]])
    assert owners(pair, points).tolist() == [0, 0, 1, 1]


@pytest.mark.parametrize(("owner", "label"), [([], []), ([0], [0, 1])])
def test_samples_must_be_there_and_match(owner: list[int], label: list[int]) -> None:
    with pytest.raises(SettingError, match="one part, label and weight"):
        purity(np.array(owner), np.array(label))
