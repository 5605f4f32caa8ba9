"""The kernel leaves out parts that are far from a block of points: what it returns is as if it did not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.fields import kernel
from partwright.fields.columns import ROTATION, SIZE, TRANSLATION, UNSIGNED, WIDTH, Column
from partwright.shapes.sampling import morton_order
from partwright.superfrusta.torch_kernel import TorchKernel
from tests.fields.test_kernel import exact

BOTH = kernel.Penalties(overlap=0.3, blending=0.2)


def scattered(seed: int, parts: int, cuts: int = 0) -> np.ndarray:
    """Rows of small parts of every form, the last of them subtracted."""
    generator = np.random.default_rng(seed)
    rows = np.ones((parts, WIDTH), np.float32)
    rows[:, TRANSLATION] = generator.uniform(-0.9, 0.9, (parts, 3))
    rows[:, ROTATION] = generator.normal(size=(parts, 4))
    rows[:, ROTATION] /= np.linalg.norm(rows[:, ROTATION], axis=1, keepdims=True)
    rows[:, SIZE] = generator.uniform(0.05, 0.6, (parts, 3))
    shape = [Column.ROUNDNESS, Column.DILATION, Column.TAPER, Column.ONION, Column.BLEND]
    rows[:, shape] = generator.uniform(0, 1, (parts, 5)) * [1, 0.1, 2, 1, 0.1]
    tightest = np.arcsin(np.minimum(1, rows[:, Column.SZ] / rows[:, Column.SX])) / (np.pi / 2)
    rows[:, Column.BULGE] = np.where(
        generator.random(parts) < 0.3, 0, tightest * generator.uniform(0, 1, parts)
    )
    rows[parts - cuts :, Column.SIGN] = -1
    return rows


def places(seed: int, count: int) -> np.ndarray:
    """Points in an order in which neighbours are near each other."""
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)).astype(np.float32)
    return points[morton_order(points)]


@pytest.mark.parametrize("cuts", [0, 3])
def test_a_fold_of_parts_all_over_the_place_equals_the_reference(cuts: int) -> None:
    rows, points = scattered(3, 14, cuts), places(4, 6000)
    difference = np.abs(kernel.evaluate(rows, points) - exact(rows, points))
    # A few points lie where a bend jumps.
    assert np.quantile(difference, 0.995) < 2e-6
    assert ((kernel.evaluate(rows, points) < 0) != (exact(rows, points) < 0)).mean() < 1e-3


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), spread=st.sampled_from([0.01, 0.1, 0.5]))
def test_clusters_of_points_are_covered_as_one_by_one(seed: int, spread: float) -> None:
    """Each block is a cluster of its own, about the surface of a part or anywhere."""
    generator = np.random.default_rng(seed)
    rows = scattered(seed, 5)
    centres = np.concatenate([generator.uniform(-1, 1, (10, 3)), rows[:, TRANSLATION]])
    points = (centres[:, None] + generator.normal(scale=spread, size=(len(centres), 128, 3))).reshape(-1, 3)
    covered = kernel.covered(rows, points)
    np.testing.assert_array_equal(covered, kernel.evaluate_parts(rows, points) < 0)
    assert covered.any()


@pytest.mark.parametrize("cuts", [0, 3])
@pytest.mark.parametrize("beta", [40.0, 200.0])
def test_equations_of_far_parts_are_those_of_all(beta: float, cuts: int) -> None:
    rows, points = scattered(5, 12, cuts), places(6, 4000)
    moved = rows.copy()
    moved[:, TRANSLATION] += 0.01
    target = kernel.Target(points, kernel.evaluate(moved, points), np.full(4000, 1 / 4000, np.float32))
    loss, gradient, matrix = kernel.normal_equations(rows, target, beta, BOTH)
    everywhere, slope, square = TorchKernel("cpu").normal_equations(rows, target, beta, BOTH)
    assert loss == pytest.approx(everywhere, rel=1e-4)
    np.testing.assert_allclose(gradient, slope, rtol=1e-2, atol=2e-3 * np.abs(slope).max())
    np.testing.assert_allclose(matrix, square, rtol=1e-2, atol=2e-3 * np.abs(square).max())


def test_a_part_is_found_from_samples_in_any_order() -> None:
    """The order of samples is the kernel's own affair."""
    rows, points = scattered(7, 6), places(8, 5000)
    start = rows.copy()
    start[:, TRANSLATION] += 0.01
    weight = np.full(5000, 1 / 5000, np.float32)
    limits = kernel.Limits((-9.0,) * 15, (9.0,) * 15, (0.3,) * 15)
    free = np.zeros((6, 15), bool)
    free[:, :3] = True
    stages = ((40.0, 20), (100.0, 20))
    for order in (np.arange(5000), np.random.default_rng(0).permutation(5000)):
        target = kernel.Target(points[order], kernel.evaluate(rows, points[order]), weight)
        found, loss, _ = kernel.levenberg_marquardt(start, target, stages, limits, free=free)
        assert loss < 1e-9
        np.testing.assert_allclose(found[:, TRANSLATION], rows[:, TRANSLATION], atol=1e-4)


@pytest.mark.parametrize("split", [0, 301, 1000])
def test_sums_of_occupancies_equal_numpy(split: int) -> None:
    generator = np.random.default_rng(9)
    occupied, inside = generator.random((7, 1000)) < 0.4, generator.random(1000) < 0.5
    weight = generator.uniform(0.5, 2, 1000).astype(np.float32)
    found = kernel.occupancy_sums(occupied, inside, weight, split)
    for side, which in enumerate((slice(None, split), slice(split, None))):
        both, either = occupied & inside, occupied | inside
        for column, one in enumerate((both, either)):
            np.testing.assert_allclose(found[:, side, column], one[:, which] @ weight[which], rtol=1e-6)


def test_sums_of_shapes_that_do_not_go_together_are_refused() -> None:
    flags, weight = np.zeros((2, 5), bool), np.ones(5, np.float32)
    with pytest.raises(ValueError, match="do not go together"):
        kernel.occupancy_sums(flags, np.zeros(4, bool), weight, 2)
    with pytest.raises(ValueError, match="split"):
        kernel.occupancy_sums(flags, np.zeros(5, bool), weight, 6)


def test_the_sign_may_be_left_out() -> None:
    rows, points = scattered(1, 4), places(2, 300)
    np.testing.assert_array_equal(kernel.covered(rows[:, :UNSIGNED], points), kernel.covered(rows, points))
