import numpy as np
import pytest

from partwright.superfrusta.deviations import Deviations, places

APART = np.array([[-0.5, 0, 0], [0.6, 0, 0], [0.61, 0, 0]], np.float32)


def seen(part: list[int], off: list[float]) -> Deviations:
    distance = np.zeros(len(part), np.float32)
    return Deviations(APART[: len(part)], distance, np.array(off, np.float32), np.array(part, np.int64), 2)


def test_a_part_that_is_off_in_two_places_has_two_faults() -> None:
    assert seen([0], [0.05]).norm == pytest.approx(0.05)
    assert seen([0, 0], [0.05, 0.05]).norm == pytest.approx(2**0.25 * 0.05)
    assert seen([0, 1], [0.05, 0.05]).norm == pytest.approx(2**0.25 * 0.05)


def test_points_side_by_side_are_one_fault_of_each_part_that_is_off_there() -> None:
    assert seen([0, 0, 0], [0.05, 0.03, 0.02]).norm == pytest.approx((0.05**4 + 0.03**4) ** 0.25)
    assert seen([0, 0, 1], [0.05, 0.03, 0.02]).norm == pytest.approx((0.05**4 + 0.03**4 + 0.02**4) ** 0.25)


def test_what_is_far_off_counts_no_more_than_a_sixth_of_the_longest_side() -> None:
    assert seen([0, 1], [0.9, 0.05]).norm == pytest.approx((0.3**4 + 0.05**4) ** 0.25)


def test_nothing_off_is_no_fault() -> None:
    assert seen([], []).norm == 0


def test_places_far_outside_are_still_told_by_part() -> None:
    far = np.array([[50, 0, 0], [60, 0, 0], [60, 0, 0]], np.float32)
    assert places(np.array([0, 0, 1]), far).tolist() == [0, 0, 1]
