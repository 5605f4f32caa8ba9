"""The compiled kernel against the readable reference: values, gradients, and threads."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.fields import SuperFrustum, kernel, reference
from partwright.fields.columns import (
    POSE,
    PROPORTIONS,
    ROTATION,
    SHAPE,
    SHAPE_STEP,
    SIZE,
    STEP_WIDTH,
    TRANSLATION,
    TRANSLATION_STEP,
    WIDTH,
    Column,
)

# A float32 kernel picks the wrong one of two equally near edges within about sqrt(eps) of where they tie.
STEP = 5e-4


def random_rows(generator: np.random.Generator, parts: int) -> np.ndarray:
    """Rows (parts, 16) over the full range of every parameter, some of them at its ends."""
    shape = generator.uniform(0, 1, (parts, 9)) * [1.8, 1.8, 1.8, 1, 0.5, 2, 1, 1, 0.5]
    ends = np.array([0, 0, 0, 1, 0, 1, 0, 0, 0]), np.array([1.8, 1.8, 1.8, 1, 0.5, 2, 1, 1, 0.5])
    at_end = generator.integers(0, 12, shape.shape)
    shape = np.where(at_end == 0, ends[0], np.where(at_end == 1, ends[1], shape))
    rotation = generator.normal(size=(parts, 4))
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    translation = generator.uniform(-0.5, 0.5, (parts, 3))
    return np.hstack([translation, rotation, shape]).astype(np.float32)


def signed(rows: np.ndarray) -> np.ndarray:
    """The rows with every other part, and the last, subtracted: nested differences."""
    signs = np.where(np.arange(len(rows)) % 2, -1.0, 1.0)
    signs[-1] = -1.0 if len(rows) > 1 else 1.0
    return np.hstack([rows, signs[:, None]]).astype(np.float32)


def inner_rows(generator: np.random.Generator, parts: int) -> np.ndarray:
    """Rows away from the ends of the ranges, where every gradient exists, and away from sx = sy."""
    rows = random_rows(generator, parts)
    rows[:, SIZE] = generator.uniform(0.05, 1.8, (parts, 3))
    rows[:, PROPORTIONS] = generator.uniform(0.02, 0.98, (parts, 5)) * [1, 0.3, 2, 1, 1]
    rows[:, Column.BLEND] = generator.uniform(0.01, 0.5, parts)
    return rows


def random_points(generator: np.random.Generator, count: int) -> np.ndarray:
    return generator.uniform(-1, 1, (count, 3)).astype(np.float32)


def exact(rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    return reference.evaluate(torch.tensor(rows).double(), torch.tensor(points).double()).numpy()


def well_conditioned(rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Where the field does not jump and is not steep: not at the centre of an arc, nor right behind it."""
    centre, worst = exact(rows, points), np.zeros(len(points))
    for axis in range(3):
        for step in (-1e-6, 1e-6):
            moved = points.astype(np.float64)
            moved[:, axis] += step
            worst = np.maximum(worst, np.abs(exact(rows, moved) - centre))
    return worst < 1e-5


@pytest.mark.parametrize("seed", range(8))
def test_values_equal_the_reference(seed: int) -> None:
    generator = np.random.default_rng(seed)
    for parts in (1, 1, 1, 1, 5):
        rows, points = random_rows(generator, parts), random_points(generator, 1000)
        smooth = well_conditioned(rows, points)
        assert smooth.mean() > 0.99
        np.testing.assert_allclose(
            kernel.evaluate(rows, points)[smooth], exact(rows, points)[smooth], rtol=0, atol=1e-5
        )


@pytest.mark.parametrize("seed", range(4))
def test_subtracted_parts_equal_the_reference(seed: int) -> None:
    generator = np.random.default_rng(seed)
    rows, points = signed(random_rows(generator, 5)), random_points(generator, 1000)
    smooth = well_conditioned(rows, points)
    values = kernel.evaluate(rows, points)
    np.testing.assert_allclose(values[smooth], exact(rows, points)[smooth], rtol=0, atol=1e-5)


def test_subtraction_takes_from_what_came_before_and_from_nothing_else() -> None:
    def cube(side: float, sign: float) -> list[float]:
        return [0, 0, 0, 1, 0, 0, 0, side, side, side, 0, 0, 1, 0, 0, 0, sign]

    centre, wall = np.zeros((1, 3), np.float32), np.full((1, 3), 0.4, np.float32)
    hollow = np.array([cube(1, 1), cube(0.5, -1)])
    assert kernel.evaluate(hollow, centre) > 0 > kernel.evaluate(hollow, wall)
    filled = np.array([cube(1, 1), cube(0.5, -1), cube(0.2, 1)])
    assert kernel.evaluate(filled, centre) < 0
    nothing = np.array([cube(1, -1)])
    assert kernel.evaluate(nothing, centre) > 1
    np.testing.assert_allclose(kernel.evaluate(np.array([cube(0.5, -1), cube(1, 1)]), centre), -0.5)


def test_without_signs_every_part_is_added() -> None:
    generator = np.random.default_rng(0)
    rows, points = random_rows(generator, 4), random_points(generator, 200)
    added = np.hstack([rows, np.ones((4, 1), np.float32)])
    np.testing.assert_array_equal(kernel.evaluate(rows, points), kernel.evaluate(added, points))


def test_parts_alone_equal_the_reference() -> None:
    generator = np.random.default_rng(0)
    rows, points = random_rows(generator, 6), random_points(generator, 300)
    alone = kernel.evaluate_parts(rows, points)
    assert alone.shape == (6, 300)
    for row, distances in zip(rows, alone, strict=True):
        np.testing.assert_array_equal(distances, kernel.evaluate(row[None], points))


def moved(rows: torch.Tensor, change: torch.Tensor) -> torch.Tensor:
    """Rows (..., 16) after a change (..., 15) in the kernel's order of derivatives."""
    w, x, y, z = rows[..., ROTATION].unbind(-1)
    a, b, c = (change[..., 3:6] / 2).unbind(-1)
    turned = torch.stack(
        [
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        ],
        -1,
    )
    shape = rows[..., SHAPE] + change[..., SHAPE_STEP]
    return torch.cat(
        [rows[..., TRANSLATION] + change[..., TRANSLATION_STEP], turned, shape, rows[..., Column.SIGN :]], -1
    )


def folded(rows: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """Distance (N,) of each point (N, 3) to its own copy of the assembly: rows (M, N, 16 or 17)."""
    pose = (rows[..., TRANSLATION], rows[..., ROTATION])
    shape = (rows[..., SIZE], *rows[..., PROPORTIONS].unbind(-1))
    signs = rows[:, 0, Column.SIGN] if rows.shape[-1] == WIDTH else None
    alone = reference.part_distance(points[:, None], *pose, *shape)[..., 0]
    return reference.fold(alone, rows[..., Column.BLEND], signs)


def central_difference(
    rows: torch.Tensor, direction: torch.Tensor, points: torch.Tensor, step: float
) -> torch.Tensor:
    ahead, behind = (folded(moved(rows, sign * step * direction), points) for sign in (1, -1))
    return (ahead - behind) / (2 * step)


def reference_gradients(rows: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Autograd's gradients (N, M, 15) in float64, and whether finite differences confirm them (N,)."""
    count, each = len(points), len(rows) * STEP_WIDTH
    copies = torch.tensor(rows).double()[:, None]
    at = torch.tensor(points).double()
    change = torch.zeros(len(rows), count, STEP_WIDTH, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(folded(moved(copies.expand(-1, count, -1), change), at).sum(), change)
    # In all directions at once: each has its own copy (M, M * 15 * N, 15) of the assembly at every point.
    directions = torch.eye(each, dtype=torch.float64).reshape(len(rows), STEP_WIDTH, each).transpose(1, 2)
    direction = directions.repeat_interleave(count, dim=1)
    copies, everywhere = copies.expand(-1, each * count, -1), at.repeat(each, 1)
    coarse, fine = (central_difference(copies, direction, everywhere, step) for step in (STEP, STEP / 2))
    numeric = ((4 * fine - coarse) / 3).reshape(each, count)
    analytic = gradient.transpose(1, 2).reshape(each, count)
    smooth = ((numeric - analytic).abs() <= 1e-4 * analytic.abs().clamp(min=1e-3)).all(dim=0)
    return gradient.transpose(0, 1).numpy(), smooth.numpy()


@pytest.mark.parametrize("bulge", [None, 0.0, 1e-6, 1e-3])
@pytest.mark.parametrize(("seed", "parts"), [(0, 1), (1, 1), (2, 2), (3, 3)])
def test_gradients_equal_the_reference_away_from_kinks(seed: int, parts: int, bulge: float | None) -> None:
    generator = np.random.default_rng(seed)
    for turn in range(3):
        rows, points = inner_rows(generator, parts), random_points(generator, 100)
        rows = signed(rows) if turn and bulge is None else rows
        if bulge is not None:  # a straight part has to feel which way to bend
            rows[:, Column.BULGE] = bulge
        expected, smooth = reference_gradients(rows, points)
        assert smooth.mean() > 0.9
        one = np.ones(1, np.float32)
        found = np.array([kernel.gradients(rows, point[None], one) for point in points[smooth]])
        allowed = 1e-3 * np.maximum(np.abs(expected[smooth]), 1e-3)
        assert (np.abs(found - expected[smooth]) / allowed).max() <= 1


def test_gradients_weight_and_sum_the_points() -> None:
    generator = np.random.default_rng(0)
    rows, points = inner_rows(generator, 3), random_points(generator, 500)
    upstream = generator.normal(size=500).astype(np.float32)
    one = np.ones(1, np.float32)
    single = np.array([kernel.gradients(rows, point[None], one) for point in points])
    total = kernel.gradients(rows, points, upstream)
    np.testing.assert_allclose(total, np.tensordot(upstream, single, 1), rtol=1e-4, atol=1e-4)


def test_threads_do_not_change_a_bit() -> None:
    generator = np.random.default_rng(0)
    rows, points = random_rows(generator, 5), random_points(generator, 20_000)
    upstream = generator.normal(size=len(points)).astype(np.float32)
    for threads in (2, 3, 7):
        np.testing.assert_array_equal(
            kernel.evaluate(rows, points, threads), kernel.evaluate(rows, points, 1)
        )
        np.testing.assert_array_equal(
            kernel.gradients(rows, points, upstream, threads), kernel.gradients(rows, points, upstream, 1)
        )


@settings(max_examples=150)
@given(st.integers(0, 2**32 - 1))
def test_no_nan_at_the_ends_of_the_ranges(seed: int) -> None:
    generator = np.random.default_rng(seed)
    lengths, fractions = [0, 1e-8, 1e-3, 0.5, 1.8], [0, 1e-7, 0.5, 1]
    ends = [lengths] * 3 + [
        fractions,
        [0, 1e-6, 0.3],
        [0, 1e-7, 1, 2],
        fractions,
        fractions,
        [0, 1e-9, 1e-5, 1],
    ]
    rows = random_rows(generator, 3)
    rows[:, 7:] = np.transpose([generator.choice(values, 3) for values in ends])
    special = generator.choice([0, 1e-7, 0.5, -0.5, 0.9], (40, 3)).astype(np.float32)
    rows[0, POSE] = [0, 0, 0, 1, 0, 0, 0]
    assert np.isfinite(kernel.evaluate_parts(rows, special)).all()
    assert np.isfinite(kernel.gradients(rows, special, np.ones(40, np.float32))).all()


def test_no_points_and_wrong_shapes() -> None:
    row = random_rows(np.random.default_rng(0), 1)
    assert kernel.evaluate(row, np.empty((0, 3), np.float32)).shape == (0,)
    with pytest.raises(ValueError, match="points must be"):
        kernel.evaluate(row, np.zeros((4, 2), np.float32))
    with pytest.raises(ValueError, match="parameter rows must be"):
        kernel.evaluate(row[:, :12], np.zeros((4, 3), np.float32))


def test_what_is_nothing_to_the_kernel_is_nothing_to_the_reference() -> None:
    """A slit or a bend below the least number of single precision: solid and straight for both."""
    for name in ("onion", "bulge"):
        field = SuperFrustum((1.0, 1.0, 1.0), **{name: 2.3e-308})
        assert field == SuperFrustum((1.0, 1.0, 1.0))
        assert getattr(SuperFrustum((1.0, 1.0, 1.0), **{name: 1e-30}), name) == 1e-30
