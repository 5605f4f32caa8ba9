"""Rows with few columns: the same bits as NumPy's own reductions."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.rows import corners, crosses, dots, following, lengths, sums, units


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(0, 3), (1, 3), (500, 3), (500, 2), (4, 50, 3), (3,)])
def test_the_bits_are_those_of_numpy(shape: tuple[int, ...], dtype: type) -> None:
    rng = np.random.default_rng(0)
    one, other = (rng.normal(size=shape).astype(dtype) * 10.0 ** rng.integers(-8, 8) for _ in range(2))
    one, other = one.astype(dtype), other.astype(dtype)
    wanted = [one.sum(axis=-1), (one * other).sum(axis=-1), np.linalg.norm(one, axis=-1)]
    for found, want in zip((sums(one), dots(one, other), lengths(one)), wanted, strict=True):
        assert found.dtype == want.dtype
        np.testing.assert_array_equal(found, want)
    if shape[0]:
        np.testing.assert_array_equal(following(one), np.roll(one, -1, axis=0))
    if shape[-1] == 3:
        np.testing.assert_array_equal(crosses(one, other), np.cross(one, other))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int64])
def test_corners_are_the_ends_of_each_column(dtype: type) -> None:
    rows = (100 * np.random.default_rng(3).normal(size=(400, 3))).astype(dtype)
    for found, want in zip(corners(rows[::3]), (rows[::3].min(axis=0), rows[::3].max(axis=0)), strict=True):
        assert found.dtype == want.dtype
        np.testing.assert_array_equal(found, want)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_units_have_length_one_however_short_rows_are(dtype: type) -> None:
    rows = np.random.default_rng(2).normal(size=(100, 3)).astype(dtype) * dtype(1e-15)
    rows[7] = 0
    found = units(rows)
    assert found.dtype == dtype
    assert (found[7] == 0).all()
    np.testing.assert_allclose(np.delete(np.linalg.norm(found, axis=1), 7), 1, atol=1e-6)
    assert (dots(found, rows) >= 0).all()


def test_one_row_goes_with_many() -> None:
    rows, one = np.random.default_rng(1).normal(size=(20, 3)), np.array([1.0, -2.0, 0.5])
    np.testing.assert_array_equal(dots(rows, one), (rows * one).sum(axis=1))
    np.testing.assert_array_equal(crosses(rows, one), np.cross(rows, one))
    np.testing.assert_array_equal(lengths(rows[:, ::-1]), np.linalg.norm(rows[:, ::-1], axis=1))
