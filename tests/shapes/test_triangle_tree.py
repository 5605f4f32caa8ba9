"""The compiled tree of triangles against scan conversion and libigl."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import sphere

from partwright._kernel import TriangleTree
from partwright.shapes.distance import MeshDistance
from partwright.shapes.winding import winding_grid


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_windings_are_those_of_scan_conversion_also_on_edges_and_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Closed, wildly self-intersecting, with corners on the lines along which both count.
    mesh = sphere(subdivisions=1)
    faces = np.asarray(mesh.faces, np.int64)
    vertices = np.round(rng.uniform(-1, 1, (len(mesh.vertices), 3)) * 8) / 8
    counted = winding_grid(vertices, faces, (-1, -1, -1), 0.125, (17, 17, 17))
    points = 0.125 * np.argwhere(np.ones(counted.shape)) - 1
    tree = TriangleTree(vertices, faces)
    clear = tree.squared_distances(points, 1) > 1e-12  # on the surface itself either is right
    assert clear.mean() > 0.5
    np.testing.assert_array_equal(tree.windings(points, 1)[clear], counted.ravel()[clear])


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), thin=st.sampled_from([1.0, 1e-3, 1e-6]))
def test_distances_are_those_of_libigl_for_slivers_too(seed: int, thin: float) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (40, 3, 3))
    corners[:, 2] = corners[:, :2].mean(axis=1) + thin * (corners[:, 2] - corners[:, :2].mean(axis=1))
    vertices, faces = corners.reshape(-1, 3), np.arange(120).reshape(-1, 3)
    points = np.concatenate([rng.uniform(-1.5, 1.5, (300, 3)), corners.mean(axis=1), vertices])
    squared = TriangleTree(vertices, faces).squared_distances(points, 1)
    expected, *_ = igl.point_mesh_squared_distance(points, vertices, faces)
    np.testing.assert_allclose(np.sqrt(squared), np.sqrt(expected), atol=1e-13 / thin)


def test_triangles_without_area_are_edges_and_points() -> None:
    vertices = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [5, 5, 5]], dtype=float)
    tree = TriangleTree(vertices, np.array([[0, 1, 2], [3, 3, 3]]))
    squared = tree.squared_distances(np.array([[1.5, 1, 0], [-3, 0, 4], [5, 5, 7]], dtype=float), 1)
    np.testing.assert_allclose(squared, [1, 25, 4])


def test_threads_change_nothing() -> None:
    mesh = sphere(subdivisions=3)
    tree = TriangleTree(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64))
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (3000, 3))
    for ask in (tree.squared_distances, tree.windings):
        np.testing.assert_array_equal(ask(points, 1), ask(points, 3))


@pytest.mark.parametrize("count", [5, 3000])
def test_signs_of_a_closed_surface_do_without_the_fast_winding_number(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes fifty times as long, and is good to a hundredth."""
    mesh = sphere(subdivisions=3)
    faces = np.asarray(mesh.faces, np.int64)
    surface = MeshDistance(np.asarray(mesh.vertices), faces, faces, closed=True)
    monkeypatch.setattr(MeshDistance, "winding", None)
    points = np.random.default_rng(1).uniform(-1.2, 1.2, (count, 3))
    outside = np.linalg.norm(points, axis=1) > 1
    clear = np.abs(np.linalg.norm(points, axis=1) - 1) > 0.02
    np.testing.assert_array_equal((surface.signed(points) > 0)[clear], outside[clear])


def test_without_triangles_all_is_far_and_outside() -> None:
    tree = TriangleTree(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    points = np.zeros((2, 3))
    assert np.isinf(tree.squared_distances(points, 0)).all()
    assert not tree.windings(points, 0).any()
