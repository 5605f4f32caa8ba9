"""Each measure against cases that can be worked out by hand."""

from __future__ import annotations

import sys
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part
from partwright.errors import SettingError
from partwright.fields import Box, Sphere
from partwright.metrics.bi_surface import bi_surface_iou
from partwright.metrics.chamfer import chamfer
from partwright.metrics.deviation import deviation, place_name, protrusion
from partwright.metrics.emd import emd
from partwright.metrics.iou import iou, occupancy_iou
from partwright.metrics.overlap import overlap


def on_sphere(count: int, radius: float, seed: int) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True)


def ball(radius: float):
    return lambda points: np.linalg.norm(points, axis=1) - radius


def box(x: float):
    """A box of side 1 whose middle is at x."""
    return Part(Box((1.0, 1.0, 1.0)), translation=(x, 0.0, 0.0))


def test_iou_of_two_boxes_is_exact() -> None:
    """Sides 1 on cells of 1/64: offset by a quarter they share 3/4 of 5/4."""
    axis = (np.arange(128) + 0.5) / 64 - 1
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    shifted = (np.abs(x - 0.25) < 0.5) & (np.abs(y) < 0.5) & (np.abs(z) < 0.5)
    assert iou(box(0.0).distance, shifted) == pytest.approx(0.75 / 1.25, abs=1e-12)


def test_iou_limits() -> None:
    full, empty = np.ones((4, 4, 4), bool), np.zeros((4, 4, 4), bool)
    assert occupancy_iou(full, full) == 1.0
    assert occupancy_iou(full, empty) == 0.0
    assert occupancy_iou(empty, empty) == 1.0
    with pytest.raises(SettingError):
        occupancy_iou(full, np.ones((5, 5, 5), bool))


def test_bi_surface_iou_of_concentric_spheres() -> None:
    """Near a flat surface the noise is normal along its normal; a gap of one sigma leaves, around the inner
    surface, P(n < 0) / P(n < 1 sigma), and around the outer one P(n < -1 sigma) / P(n < 0)."""
    inner, outer = 0.80, 0.82
    score = bi_surface_iou(ball(inner), ball(outer), on_sphere(20_000, inner, 0), on_sphere(20_000, outer, 1))
    below = 0.841345
    assert score == pytest.approx((0.5 / below + (1 - below) / 0.5) / 2, abs=0.02)
    assert bi_surface_iou(ball(0.8), ball(0.8), on_sphere(99, 0.8, 0), on_sphere(99, 0.8, 1)) == 1.0


def test_chamfer_of_concentric_spheres() -> None:
    """A gap of g costs 2 g^2 above the floor of the sampling."""
    first, second, again = on_sphere(30_000, 0.7, 0), on_sphere(30_000, 0.8, 1), on_sphere(30_000, 0.7, 2)
    floor = chamfer(first, again)
    assert 0 < floor < 3e-4
    assert chamfer(first, second) - floor == pytest.approx(2 * 0.1**2, rel=0.02)


def test_chamfer_by_hand() -> None:
    pair, single = np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0.0, 0, 2]])
    assert chamfer(pair, single) == pytest.approx((4 + 5) / 2 + 4)


@settings(max_examples=20)
@given(shift=st.tuples(*[st.floats(-2, 2)] * 3), seed=st.integers(0, 99))
def test_emd_of_a_shifted_set_is_the_shift(shift: tuple[float, float, float], seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(100, 3))
    moved = rng.permutation(points + shift)
    assert emd(points, moved) == pytest.approx(np.linalg.norm(shift), abs=1e-9)


def test_emd_finds_the_best_matching() -> None:
    """Nearest neighbours would pair both with the first point."""
    assert emd(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[1.0, 0, 0], [5, 0, 0]])) == pytest.approx(2.5)
    with pytest.raises(SettingError):
        emd(np.zeros((3, 3)), np.zeros((4, 3)))


def test_overlap_of_half_overlapping_boxes() -> None:
    """Two unit boxes offset by half a side: 1/2 of 3/2 is covered twice."""
    assert overlap(box(0.0) | box(0.5)) == pytest.approx(1 / 3, abs=0.01)
    assert overlap(box(0.0) | box(1.1)) == 0.0
    assert overlap(box(0.0) | box(0.0)) == 1.0


def test_overlap_ignores_blends_and_subtracted_parts() -> None:
    blended = Assembly((box(0.0), Part(Box((1.0, 1.0, 1.0)), (0.5, 0.0, 0.0), blend=0.4)))
    assert overlap(blended) == pytest.approx(1 / 3, abs=0.01)
    cut = (box(0.0) | box(0.5)) - Part(Sphere(2.0), (1.0, 0.0, 0.0))
    assert overlap(cut) == pytest.approx(1 / 3, abs=0.01)


def test_overlap_of_hundreds_of_parts_fits_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """With fewer distances at once: in one piece they take three times as much."""
    monkeypatch.setattr(sys.modules["partwright.metrics.overlap"], "_AT_ONCE", 1 << 20)
    side = 8
    places = np.stack(np.meshgrid(*[2.0 * np.arange(side)] * 3), axis=-1).reshape(-1, 3).tolist()
    apart = Assembly(tuple(Part(Box((1.0, 1.0, 1.0)), tuple(place)) for place in places))
    tracemalloc.start()
    assert overlap(apart, resolution=64) == 0.0
    assert tracemalloc.get_traced_memory()[1] < 4e7
    tracemalloc.stop()


def test_an_intersection_counts_as_one_part() -> None:
    lens = box(0.0) & box(0.5)
    assert overlap(Assembly((lens,))) == 0.0
    assert overlap(Assembly((lens, box(0.0)))) == pytest.approx(0.5, abs=0.01)


@settings(max_examples=10)
@given(scale=st.floats(1e-5, 1e5), x=st.floats(-100, 100))
def test_overlap_does_not_change_with_size_and_place(scale: float, x: float) -> None:
    pair = box(0.0) | box(0.5)
    assert overlap(pair.translated((x, 0.0, 0.0)).scaled(scale)) == pytest.approx(1 / 3, abs=0.02)


def test_deviation_takes_the_worse_direction() -> None:
    here, there = np.eye(3), 2 * np.eye(3)
    found = deviation(here, np.array([0.1, 0.2, 0.1]), there, np.array([0.0, 0.0, 0.5]), 0.1)
    assert found.maximum == 0.5
    np.testing.assert_array_equal(found.worst_point, there[2])
    assert found.quantile_95 == pytest.approx(max(0.19, 0.45))


def test_what_sticks_out_is_the_furthest_that_lies_outside() -> None:
    points = np.random.default_rng(0).normal(size=(1800, 3))
    signed = np.linalg.norm(points, axis=1) - 2.5
    away = np.abs(signed)
    assert away.argmax() != signed.argmax()  # the furthest is inside
    asked = []

    def distance(some: np.ndarray) -> np.ndarray:
        asked.append(len(some))
        return np.linalg.norm(some, axis=1) - 2.5

    assert protrusion(distance, points, away) == pytest.approx(signed.max())
    assert sum(asked) < len(points)
    assert protrusion(distance, 0.1 * points, away) == 0.0


@pytest.mark.parametrize(
    ("point", "up", "name"),
    [
        ((0.8, -0.4, 0.4), "z", "front upper right"),
        ((-0.8, 0.4, -0.4), "z", "back lower left"),
        ((-0.8, 0.4, -0.4), "y", "back upper left"),
        ((0.0, 0.0, 0.0), "z", "middle"),
        ((0.0, 0.1, 0.45), None, "upper"),
    ],
)
def test_places_have_names(point: tuple[float, float, float], up: str | None, name: str) -> None:
    assert place_name(np.array(point), np.array([1.8, 1.0, 1.0]), up) == name
