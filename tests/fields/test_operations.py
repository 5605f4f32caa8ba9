"""Set operations on distances: the laws of sets, and the smooth minimum's formula."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from partwright import fields

A, B = np.random.default_rng(0).normal(size=(2, 500))
OF = {"numpy": lambda a: a, "torch": torch.tensor}


@pytest.mark.parametrize("library", OF)
def test_signs_follow_the_sets(library: str) -> None:
    a, b = OF[library](A), OF[library](B)
    np.testing.assert_array_equal(fields.union(a, b) < 0, (A < 0) | (B < 0))
    np.testing.assert_array_equal(fields.intersection(a, b) < 0, (A < 0) & (B < 0))
    np.testing.assert_array_equal(fields.difference(a, b) < 0, (A < 0) & ~(B < 0))


@pytest.mark.parametrize("library", OF)
@pytest.mark.parametrize("k", [1e-5, 0.03, 0.5, 2.0])
def test_smooth_union_is_the_polynomial_minimum(library: str, k: float) -> None:
    w = np.clip(0.5 + (B - A) / (2 * k), 0, 1)
    expected = B * (1 - w) + A * w - k * w * (1 - w)
    np.testing.assert_allclose(fields.smooth_union(OF[library](A), OF[library](B), k), expected, atol=1e-12)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(0, 2))
def test_smooth_union_laws(first: float, second: float, k: float) -> None:
    a, b = np.array([first]), np.array([second])
    blended = fields.smooth_union(a, b, k)
    assert blended == fields.smooth_union(b, a, k)
    assert np.minimum(a, b) - k / 4 - 1e-12 <= blended <= np.minimum(a, b)
    if k <= 1e-9 or abs(first - second) >= k:
        assert blended == np.minimum(a, b)
    np.testing.assert_array_equal(fields.smooth_intersection(a, b, k), -fields.smooth_union(-a, -b, k))
    np.testing.assert_array_equal(fields.smooth_difference(a, b, k), fields.smooth_intersection(a, -b, k))


def test_gradients_share_out_one() -> None:
    a, b, k = (torch.tensor(value, requires_grad=True) for value in (A, B, np.full(500, 0.7)))
    da, db, dk = torch.autograd.grad(fields.smooth_union(a, b, k).sum(), [a, b, k])
    np.testing.assert_allclose(da + db, 1)
    assert ((dk <= 0) & (dk >= -0.25)).all()
    near = [(torch.tensor(v).requires_grad_()) for v in (A[:20] / 10, B[:20] / 10, np.full(20, 2.0))]
    assert torch.autograd.gradcheck(fields.smooth_union, near)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_precision_is_kept(dtype: Any) -> None:
    assert fields.smooth_union(A.astype(dtype), B.astype(dtype), 0.3).dtype == dtype
    assert fields.smooth_union(torch.tensor(A.astype(dtype)), torch.tensor(B), 0.3).dtype == torch.float64


@pytest.mark.parametrize("k", [0.0, 1e-9, 1e-8, 0.02, 0.5])
def test_one_blend_for_all_is_that_blend_for_each(k: float) -> None:
    a, b = np.random.default_rng(0).normal(size=(2, 500)).astype(np.float32)
    one, each = fields.smooth_union(a, b, k), fields.smooth_union(a, b, np.full(500, k))
    assert one.dtype == each.dtype == np.float32
    np.testing.assert_array_equal(one, each)
