"""Signed distances, grids and occupancies against exact boxes and spheres."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import box, box_distance, inverted, sphere, together

from partwright.errors import NotFiniteError, SettingError
from partwright.shapes import DistanceGrid, UnitFrame, load_shape
from partwright.shapes.distance import MeshDistance
from partwright.shapes.topology import EdgeTable
from partwright.shapes.winding import closing_fans, winding_grid

HALF = np.array([0.9, 0.6, 0.3])


@pytest.fixture(scope="module")
def brick():
    return load_shape(box(2 * HALF * 10, (5, -7, 100)))


def test_unit_distance_of_a_box_is_exact(brick):
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3)).astype(np.float32)
    np.testing.assert_allclose(brick.unit_distance(points), box_distance(points, HALF), atol=1e-6)
    assert brick.unit_distance(points).dtype == np.float32
    np.testing.assert_allclose(brick.unit_unsigned(points), np.abs(box_distance(points, HALF)), atol=1e-12)
    np.testing.assert_array_equal(brick.unit_away(points), np.abs(brick.unit_distance(points)))
    near = np.abs(brick.unit_distance(points)) < 0.1
    np.testing.assert_array_equal(brick.unit_away(points, 0.1)[near], brick.unit_away(points)[near])
    assert (brick.unit_away(points, 0.1)[~near] >= 0.1).all()
    few = load_shape(box(2 * HALF * 10, (5, -7, 100))).unit_distance(points[:50])  # without lattice of signs
    np.testing.assert_array_equal(few, brick.unit_distance(points)[:50])
    np.testing.assert_array_equal(few, brick.unit_distance(points[:50]))


def test_signed_distance_is_in_own_units(brick):
    points = np.array([[5, -7, 100], [5, -7, 110], [20, -7, 100]], dtype=float)
    np.testing.assert_allclose(brick.signed_distance(points), [-3, 7, 6], rtol=1e-5)


def test_distance_agrees_with_libigl_in_value_and_sign():
    rng = np.random.default_rng(1)
    mesh = sphere(subdivisions=3)
    bumpy = trimesh.Trimesh(mesh.vertices * rng.uniform(0.7, 1.0, (len(mesh.vertices), 1)), mesh.faces)
    shape = load_shape(bumpy)
    points = shape.samples(4000, 4000, seed=2).points.astype(np.float64)
    vertices = shape.frame.to_unit(shape.vertices)
    kind = (
        igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL if hasattr(igl, "SIGNED_DISTANCE_TYPE_PSEUDONORMAL") else None
    )
    exact = igl.signed_distance(points, vertices, shape.faces, sign_type=kind)[0]
    np.testing.assert_allclose(shape.unit_distance(points), exact, atol=1e-6)


def test_bad_points_are_named(brick):
    with pytest.raises(NotFiniteError):
        brick.unit_distance(np.array([[0, np.nan, 0]]))
    with pytest.raises(SettingError):
        brick.unit_distance(np.zeros(3))
    assert brick.unit_distance(np.zeros((0, 3))).shape == (0,)


def test_grid_is_exact_in_the_band_and_close_beyond(brick):
    grid = brick.unit_grid(64)
    assert grid.spacing == pytest.approx(1.8 / 60)
    assert grid.values.shape[0] == 64
    exact = box_distance(grid.points(), HALF).reshape(grid.values.shape)
    band = np.abs(exact) < 2.5 * grid.spacing
    np.testing.assert_allclose(grid.values[band], exact[band], atol=1e-6)
    error = (np.abs(grid.values) - np.abs(exact)) / grid.spacing
    assert error.min() > -1e-3
    assert error.max() < 0.8
    assert error.mean() < 0.1
    np.testing.assert_array_equal(grid.values < 0, exact < 0)


def test_grid_covers_the_box_and_is_cached(brick):
    grid = brick.unit_grid(32)
    top = grid.origin + grid.spacing * (np.array(grid.values.shape) - 1)
    assert (grid.origin < -HALF - grid.spacing).all()
    assert (top > HALF + grid.spacing).all()
    assert brick.unit_grid(32) is grid
    with pytest.raises(ValueError, match="read-only"):
        grid.values[0] = 0
    with pytest.raises(SettingError):
        brick.unit_grid(2)


def test_grid_error_falls_as_the_grid_is_refined():
    shape = load_shape(sphere())
    errors = []
    for resolution in (24, 48, 96):
        grid = shape.unit_grid(resolution)
        errors.append(
            np.abs(
                grid.values - (np.linalg.norm(grid.points(), axis=1) - 0.9).reshape(grid.values.shape)
            ).max()
        )
    assert errors[0] > 1.5 * errors[1] > 2 * errors[2]


def test_occupancy_is_the_sign_at_the_cell_centres():
    shape = load_shape(together(sphere(), inverted(sphere(0.5)), sphere(0.2, 2)))
    occupied = shape.unit_occupancy(64)
    centres = -1 + (np.argwhere(np.ones((64,) * 3)) + 0.5) / 32
    assert occupied.shape == (64, 64, 64)
    np.testing.assert_array_equal(occupied.ravel(), shape.unit_distance(centres) < 0)
    assert shape.unit_occupancy(64) is occupied


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_scan_conversion_is_an_exact_winding_number(seed):
    rng = np.random.default_rng(seed)
    # Closed, wildly self-intersecting, with vertices exactly on grid lines.
    mesh = sphere(subdivisions=1)
    vertices = np.round(rng.uniform(-1, 1, (len(mesh.vertices), 3)) * 8) / 8
    counted = winding_grid(vertices, np.asarray(mesh.faces), (-1.03, -1, -0.97), 0.125, (17, 18, 16))
    points = np.array([-1.03, -1, -0.97]) + 0.125 * np.argwhere(np.ones(counted.shape))
    exact = igl.winding_number(vertices, np.asarray(mesh.faces, dtype=np.int64), points)
    clear = igl.point_mesh_squared_distance(points, vertices, np.asarray(mesh.faces))[0] > 1e-12
    assert clear.mean() > 0.5
    np.testing.assert_array_equal(counted.ravel()[clear], np.round(exact[clear]))


@settings(max_examples=100)
@given(
    centre=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    size=st.floats(1e-6, 1e6),
    seed=st.integers(0, 1000),
)
def test_unit_frame_round_trip(centre, size, seed):
    points = np.array(centre) + size * np.random.default_rng(seed).uniform(-1, 1, (20, 3))
    frame = UnitFrame.of(points)
    unit = frame.to_unit(points)
    assert np.ptp(unit, axis=0).max() == pytest.approx(1.8)
    scale = np.abs(points).max()
    np.testing.assert_allclose(frame.from_unit(unit), points, rtol=1e-12, atol=1e-12 * scale)
    np.testing.assert_allclose(frame.length_from_unit(frame.length_to_unit(size)), size, rtol=1e-12)


def test_a_fold_without_thickness_does_not_turn_signs():
    corners = 0.3 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    pillow = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3], [1, 0, 3], [1, 3, 2]], process=False)
    shape = load_shape(together(box((1.8, 1.8, 1.8)), pillow))
    points = np.random.default_rng(0).uniform(-0.85, 0.85, (5000, 3)) * [1, 1, 0.1]
    assert (shape.unit_distance(points) < 0).all()
    assert shape.volume == pytest.approx(1.8**3)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), dropped=st.integers(1, 40))
def test_fans_close_any_surface(seed, dropped):
    rng = np.random.default_rng(seed)
    mesh = sphere(subdivisions=2)
    faces = np.asarray(mesh.faces)[rng.permutation(len(mesh.faces))[dropped:]]
    turned = rng.random(len(faces)) < 0.1
    faces[turned] = faces[turned, ::-1]
    vertices, fans = closing_fans(np.asarray(mesh.vertices), faces)
    assert not EdgeTable(np.concatenate([faces, fans])).balance.any()
    points = rng.uniform(-1, 1, (200, 3))
    whole = igl.winding_number(vertices, np.concatenate([faces, fans]), points)
    np.testing.assert_allclose(whole, np.round(whole), atol=1e-6)


def test_a_surface_ajar_is_filled_as_its_winding_number_says():
    mesh = sphere(subdivisions=4)
    cut = np.asarray(mesh.faces)[np.r_[3:40, 60 : len(mesh.faces)]]
    source = MeshDistance(np.asarray(mesh.vertices), cut, cut, closed=False)
    origin, spacing = np.full(3, -1.11), 0.043
    grid = source.inside_grid(origin, spacing, (52, 52, 52))
    places = origin + spacing * np.argwhere(np.ones(grid.shape))
    winding = igl.winding_number(np.asarray(mesh.vertices), cut, places)
    clear = np.abs(winding - 0.5) > 1e-6
    np.testing.assert_array_equal(grid.ravel()[clear], winding[clear] > 0.5)
    rng = np.random.default_rng(0)
    points = mesh.triangles_center[rng.integers(0, len(mesh.faces), 4000)] + rng.normal(0, 0.05, (4000, 3))
    sign = source.signed(points.astype(np.float32)) < 0
    exact = igl.winding_number(np.asarray(mesh.vertices), cut, points.astype(np.float32).astype(float))
    clear = np.abs(exact - 0.5) > 0.02  # the fast winding number is good to 0.01
    np.testing.assert_array_equal(sign[clear], exact[clear] > 0.5)


def test_bounded_search_agrees_where_it_reaches(brick):
    points = np.random.default_rng(0).uniform(-1, 1, (2000, 3))
    every, near = brick._source.unsigned(points), brick._source.unsigned(points, 0.1)
    np.testing.assert_array_equal(near[every <= 0.1], every[every <= 0.1])
    assert (near[every > 0.1] > 0.1).all()


def test_exact_distances_hold_at_triangles_of_any_form():
    """In single precision those to a bar of 1 to 180 were wrong by a thousandth of its length."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    half = np.array([0.9, 0.005, 0.005])
    bar = box(2 * half)
    faces = np.asarray(bar.faces)
    surface = MeshDistance(np.asarray(bar.vertices) @ turn, faces, faces, closed=True)
    points = np.random.default_rng(2).uniform(-1, 1, (3000, 3)) * np.array([1.0, 0.02, 0.02])
    np.testing.assert_allclose(surface.exact(points @ turn), np.abs(box_distance(points, half)), atol=1e-12)


def test_the_closest_point_is_as_far_as_the_distance():
    """Beside an edge of a long triangle, too: one to the edge was taken for it there."""
    rod = trimesh.creation.cylinder(radius=0.5, height=1.8, sections=200)
    surface = MeshDistance(np.asarray(rod.vertices), np.asarray(rod.faces), np.asarray(rod.faces), True)
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3))
    off = np.linalg.norm(surface.closest(points) - points, axis=1)
    np.testing.assert_allclose(off, surface.exact(points), atol=1e-6)


def test_points_of_some_voxels_are_those_of_all() -> None:
    grid = DistanceGrid(np.array([-0.93, 0.1, 0.2]), 0.0195652, np.zeros((5, 7, 6), np.float32))
    some = np.array([0, 209, 17, 17, 41])
    np.testing.assert_array_equal(grid.points_of(some), grid.points()[some])


def test_voxels_in_bricks_are_all_voxels_and_neighbours_come_together() -> None:
    grid = DistanceGrid(np.zeros(3), 1.0, np.zeros((9, 8, 33), np.float32))
    order = grid.in_bricks()
    np.testing.assert_array_equal(np.sort(order), np.arange(9 * 8 * 33))
    assert np.ptp(grid.points_of(order[:128]), axis=0).tolist() == [3, 3, 7]


def test_a_surface_without_triangles_is_an_error_and_no_crash() -> None:
    none = MeshDistance(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 3), np.int64), True)
    with pytest.raises(ValueError, match="without triangles"):
        none.unsigned(np.zeros((1, 3)))
