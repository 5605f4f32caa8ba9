"""Morphological decomposition on solids whose thickness is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.fields import kernel

SPACING = 0.03


def grid(half=(0.9, 0.9, 0.9)) -> np.ndarray:
    """Voxel centres (X, Y, Z, 3)."""
    axes = [np.arange(-h - 2 * SPACING, h + 2.5 * SPACING, SPACING) for h in half]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def ball(points: np.ndarray, radius: float, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    return np.linalg.norm(points - np.array(centre), axis=-1) - radius


def box(points: np.ndarray, half) -> np.ndarray:
    q = np.abs(points) - np.array(half)
    return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)


def rod(points: np.ndarray, radius: float, from_x: float, to_x: float) -> np.ndarray:
    """A capsule along x."""
    x = points[..., 0] - np.clip(points[..., 0], from_x, to_x)
    return np.sqrt(x**2 + points[..., 1] ** 2 + points[..., 2] ** 2) - radius


def decompose(field: np.ndarray, regions=7, kappa=0.02, least_depth=0.0, least_voxels=1):
    return kernel.decompose(field, SPACING, regions, kappa, least_depth, least_voxels)


LARGE, SMALL, ROD = 0.4, 0.26, 0.06


@pytest.fixture(scope="module")
def dumbbell() -> tuple[np.ndarray, np.ndarray]:
    """Voxel centres and field: a large ball on the left, a small one on the right, a thin rod between."""
    points = grid((0.9, 0.4, 0.4))
    balls = np.minimum(ball(points, LARGE, (-0.5, 0, 0)), ball(points, SMALL, (0.6, 0, 0)))
    return points, np.minimum(balls, rod(points, ROD, -0.5, 0.6))


def test_both_balls_come_before_the_rod_thickest_first(dumbbell) -> None:
    points, field = dumbbell
    labels, depths = decompose(field, kappa=1e-4)  # a core of a voxel or two: eroded to the very centre
    assert depths[0] == pytest.approx(LARGE, abs=SPACING)
    assert depths[1] == pytest.approx(SMALL, abs=SPACING)
    assert max(depths[2:]) <= ROD + SPACING
    for label, (radius, x) in enumerate([(LARGE, -0.5), (SMALL, 0.6)]):
        apart = ball(points, radius, (x, 0, 0))
        assert (labels[apart < -1.5 * SPACING] == label).all()
        assert apart[labels == label].max() < 1.5 * SPACING
    middle = (np.abs(points[..., 0] - 0.15) < 0.1) & (field < -0.5 * SPACING)
    assert not np.isin(labels[middle], (0, 1)).any()
    assert (labels[middle] >= 2).mean() > 0.5


def test_the_core_holds_the_wanted_share_of_the_volume() -> None:
    """A ball eroded by depth keeps (1 - depth / radius)^3 of its volume."""
    field = ball(grid(), 0.9)
    for kappa in (0.02, 0.1, 0.3):
        labels, depths = decompose(field, regions=1, kappa=kappa)
        assert depths == [pytest.approx(0.9 * (1 - kappa ** (1 / 3)), abs=0.5 * SPACING)]
        assert (labels[field < -SPACING] == 0).all()


def test_a_plate_is_one_region() -> None:
    points = grid((0.9, 0.9, 0.2))
    field = box(points, (0.9, 0.9, 0.1))
    labels, depths = decompose(field, least_voxels=0.01 * np.count_nonzero(field < 0))
    assert 0 < depths[0] <= 0.1
    assert np.mean(labels[field < 0] == 0) > 0.95


def test_two_touching_boxes_are_split_where_the_thickness_changes() -> None:
    points = grid((0.9, 0.4, 0.4))
    thick = box(points + np.array([0.5, 0, 0]), (0.4, 0.4, 0.4))
    thin = box(points - np.array([0.4, 0, 0]), (0.5, 0.1, 0.1))
    labels, _ = decompose(np.minimum(thick, thin))
    assert (labels[thick < -2 * SPACING] == 0).mean() > 0.7
    assert not (labels[points[..., 0] > 0.3] == 0).any()


@pytest.mark.parametrize("value", [1.0, 0.0])
def test_an_empty_field_gives_nothing(value: float) -> None:
    labels, depths = decompose(np.full((5, 6, 7), value))
    assert depths == []
    assert labels.shape == (5, 6, 7)
    assert (labels == -1).all()


@pytest.mark.parametrize("least", [0.0, 0.5, 1.0])
def test_nothing_inside_is_no_region_however_small_regions_may_be(least: float) -> None:
    """A local grid may lie outside of the shape; a share of its voxels is then none."""
    labels, depths = decompose(np.full((5, 6, 7), 0.1, np.float32), least_voxels=least)
    assert depths == []
    assert (labels == -1).all()
    ball_alone = decompose(ball(grid(), 0.3).astype(np.float32), least_voxels=least)
    assert len(ball_alone[1]) >= 1


def test_a_single_voxel() -> None:
    field = np.ones((5, 6, 7))
    field[2, 3, 4] = -0.01
    labels, depths = decompose(field)
    assert depths == [pytest.approx(0.01)]
    assert labels[2, 3, 4] == 0
    assert (labels == -1).sum() == field.size - 1
    assert decompose(field, least_voxels=2)[1] == []
    assert decompose(field, least_depth=0.02)[1] == []


def test_a_field_negative_up_to_the_border_and_a_line_of_voxels() -> None:
    labels, depths = decompose(np.full((4, 4, 4), -0.1))
    assert (labels >= 0).all()
    assert depths[0] == pytest.approx(0.1)
    line, _ = decompose(np.full((1, 1, 9), -0.01), regions=9)
    assert (line >= 0).all()


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), regions=st.integers(1, 6), kappa=st.floats(1e-4, 0.5))
def test_regions_are_disjoint_within_the_residual_and_repeat(seed: int, regions: int, kappa: float) -> None:
    generator = np.random.default_rng(seed)
    points = grid((0.4, 0.4, 0.4))
    field = np.min(
        [
            ball(points, r, c)
            for r, c in zip(
                generator.uniform(0.05, 0.3, 4), generator.uniform(-0.4, 0.4, (4, 3)), strict=True
            )
        ],
        axis=0,
    )
    least = 5
    labels, depths = decompose(field, regions, kappa, 0.5 * SPACING, least)
    assert len(depths) <= regions
    assert (field[labels >= 0] < 0).all()
    # Each voxel has one label; every label of the list is in use, and by enough voxels.
    counts = np.bincount(labels[labels >= 0], minlength=len(depths))
    assert len(counts) == len(depths)
    assert (counts >= least).all()
    assert 0 <= min(depths) <= max(depths) <= -field.min() + 1e-6
    again, same = decompose(field, regions, kappa, 0.5 * SPACING, least)
    np.testing.assert_array_equal(labels, again)
    assert depths == same
    # More regions only add to fewer.
    if len(depths) > 1:
        fewer, _ = decompose(field, len(depths) - 1, kappa, 0.5 * SPACING, least)
        np.testing.assert_array_equal(np.where(labels == len(depths) - 1, -1, labels), fewer)


def test_turning_the_grid_turns_the_regions(dumbbell) -> None:
    _, field = dumbbell
    labels, depths = decompose(field)
    turned, same = decompose(field.transpose(2, 0, 1)[:, ::-1])
    assert len(same) == len(depths)
    assert same == pytest.approx(depths, abs=0.1 * SPACING)
    assert np.mean(turned[:, ::-1].transpose(1, 2, 0) == labels) > 0.98
