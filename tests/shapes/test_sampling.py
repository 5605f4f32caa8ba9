"""Samples: where they lie, how they are weighted, and that they repeat."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from solids import box, sphere

from partwright.errors import SettingError
from partwright.shapes import load_shape
from partwright.shapes.sampling import morton_order


@pytest.fixture(scope="module")
def ball():
    return load_shape(sphere(3.0))


def test_surface_samples_lie_on_the_surface_with_outward_normals(ball):
    samples = ball.unit_surface(5000, 1)
    assert np.abs(np.linalg.norm(samples.points, axis=1) - 0.9).max() < 3e-3
    outward = samples.points / np.linalg.norm(samples.points, axis=1, keepdims=True)
    assert (outward * samples.normals).sum(axis=1).min() > 0.99
    assert np.abs(samples.points.mean(axis=0)).max() < 0.02


def test_samples_are_area_weighted():
    samples = load_shape(box((1.8, 0.9, 0.45))).unit_surface(10_000, 0)
    top = (np.abs(samples.points[:, 2]) > 0.2249).mean()
    assert top == pytest.approx(1.8 * 0.9 / (1.8 * 0.9 + 1.8 * 0.45 + 0.9 * 0.45), abs=0.005)


def test_curvature_of_a_sphere_whatever_its_triangles(ball):
    assert np.median(ball.unit_surface(5000, 0).curvature) == pytest.approx(1 / 0.9, rel=0.1)
    coarse = load_shape(sphere(3.0, subdivisions=2))
    assert coarse.unit_surface(5000, 0).curvature.mean() == pytest.approx(1 / 0.9, rel=0.6)


def test_curvature_of_a_cylinder_of_slivers():
    mesh = trimesh.creation.cylinder(radius=0.3, height=1.8, sections=200)
    samples = load_shape(mesh).unit_surface(20_000, 0)
    side = np.abs(samples.points[:, 2]) < 0.6
    assert np.median(samples.curvature[side]) == pytest.approx(1 / 0.3, rel=0.1)


def test_flat_is_zero_and_an_edge_is_large_but_bounded():
    samples = load_shape(box((1.8, 1.8, 1.8))).unit_surface(20_000, 0)
    to_edge = 0.9 - np.sort(np.abs(samples.points), axis=1)[:, 1]
    assert samples.curvature[to_edge > 0.25].max() < 1e-9
    assert samples.curvature[to_edge < 0.01].min() > 5
    assert samples.curvature.max() < 50


def test_samples_are_placed_weighted_and_measured(ball):
    samples = ball.samples(2000, 1000, seed=3)
    assert samples.points.shape == (3000, 3)
    assert samples.near == 2000
    exact = np.linalg.norm(samples.points, axis=1) - 0.9
    np.testing.assert_allclose(samples.distance, exact, atol=3e-3)
    assert np.abs(exact[:2000]).max() < 0.1
    assert np.abs(exact[2000:]).max() > 0.5
    assert samples.weight[:2000].mean() == pytest.approx(1 + 1 / (1 + np.exp(-1 / 0.9)), abs=0.02)
    assert (samples.weight[2000:] == 1).all()
    assert np.abs(samples.points).max() <= 0.951


def test_sigma_is_what_was_asked_for(ball):
    narrow = ball.samples(4000, 0, sigma=0.001)
    assert np.std(narrow.distance) == pytest.approx(0.001, rel=0.2)
    with pytest.raises(SettingError):
        ball.samples(-1, 0)


def test_seeds_repeat_and_differ(ball):
    again = load_shape(sphere(3.0)).samples(500, 500, seed=7)
    first = ball.samples(500, 500, seed=7)
    np.testing.assert_array_equal(first.points, again.points)
    np.testing.assert_array_equal(first.distance, again.distance)
    assert ball.samples(500, 500, seed=7) is first
    assert not np.array_equal(first.points, ball.samples(500, 500, seed=8).points)
    assert len(ball.samples(0, 0).points) == 0


def test_morton_order_keeps_neighbours_together():
    points = np.random.default_rng(0).random((4096, 3)).astype(np.float32)
    ordered = points[morton_order(points)]
    step = np.linalg.norm(np.diff(ordered, axis=0), axis=1).mean()
    assert step < 0.25 * np.linalg.norm(np.diff(points, axis=0), axis=1).mean()
    assert sorted(map(tuple, ordered.tolist())) == sorted(map(tuple, points.tolist()))
