"""Marching cubes: closed for every field, exact where it can be, converging where not."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.errors import NoSurfaceError, NotFiniteError, SettingError
from partwright.meshing import mesh_field
from partwright.meshing.blocks import BLOCK, Grid, block_values
from partwright.meshing.features import _SHARP, _with_features
from partwright.meshing.polygons import Polygons

LOW, HIGH = [-1.0] * 3, [1.0] * 3


def sphere(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points, axis=1) - 0.8


def box(half: tuple[float, float, float], centre: tuple[float, float, float] = (0.0, 0.0, 0.0)):
    def distance(points: np.ndarray) -> np.ndarray:
        q = np.abs(points - np.float32(centre)) - np.float32(half)
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)

    return distance


def torus(points: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.6, points[:, 2]) - 0.2


def edge_counts(mesh: trimesh.Trimesh) -> set[int]:
    return set(np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1].tolist())


def assert_closed(mesh: trimesh.Trimesh) -> None:
    assert edge_counts(mesh) == {2}
    assert mesh.is_volume
    assert mesh.volume > 0


@pytest.mark.parametrize("sharp", [False, True])
@settings(max_examples=12)
@given(seed=st.integers(0, 2**31))
def test_closed_manifold_for_random_signs(sharp: bool, seed: int) -> None:
    """Noise at the lattice holds all 256 patterns with every ambiguous face."""
    values = np.random.default_rng(seed).normal(size=(12, 12, 12))
    for axis in range(3):
        np.moveaxis(values, axis, 0)[[0, -1]] = 1.0

    def noise(points: np.ndarray) -> np.ndarray:
        from scipy.ndimage import map_coordinates

        return 0.05 * map_coordinates(values, ((points + 1) * 5.5).T, order=1, mode="nearest")

    mesh = mesh_field(noise, LOW, HIGH, 14, sharp=sharp)
    assert edge_counts(mesh) == {2}
    assert mesh.is_winding_consistent
    assert mesh.is_volume
    # Each vertex has one fan of triangles: as many corners as neighbours.
    corners = np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices))
    neighbours = np.bincount(mesh.edges_unique.ravel(), minlength=len(mesh.vertices))
    np.testing.assert_array_equal(corners, neighbours)


def test_sphere_volume_error_falls_with_the_square_of_the_cell() -> None:
    exact = 4 / 3 * np.pi * 0.8**3
    errors = []
    for resolution in (16, 32, 64):
        mesh = mesh_field(sphere, LOW, HIGH, resolution)
        assert_closed(mesh)
        assert mesh.euler_number == 2
        errors.append(abs(mesh.volume / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.8).all(), rates
    assert errors[-1] < 1e-3


def test_vertices_lie_on_the_surface_and_normals_point_outwards() -> None:
    mesh = mesh_field(sphere, LOW, HIGH, 32)
    assert np.abs(sphere(mesh.vertices)).max() < 0.01 * 2 / 32
    assert (np.einsum("fd,fd->f", mesh.face_normals, mesh.triangles_center) > 0).all()


def test_torus_has_genus_one() -> None:
    mesh = mesh_field(torus, LOW, HIGH, 48)
    assert_closed(mesh)
    assert mesh.euler_number == 0
    assert mesh.volume == pytest.approx(2 * np.pi**2 * 0.6 * 0.04, rel=0.01)


def test_box_keeps_its_edges_and_corners() -> None:
    half = (0.5, 0.6, 0.7)
    mesh = mesh_field(box(half), LOW, HIGH, 32)
    assert_closed(mesh)
    assert mesh.volume == pytest.approx(8 * np.prod(half), rel=3e-4)
    assert mesh.area == pytest.approx(8 * (0.3 + 0.35 + 0.42), rel=2e-3)
    np.testing.assert_allclose(mesh.bounds, [[-h for h in half], half], atol=1e-3)
    blunt = mesh_field(box(half), LOW, HIGH, 32, sharp=False)
    assert abs(mesh.volume - 8 * np.prod(half)) < 0.2 * abs(blunt.volume - 8 * np.prod(half))


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_a_rim_thinner_than_a_cell_is_not_serrated(turn: int) -> None:
    """A funnel's acute rim passes between the corners of the lattice: its vertices lie beyond their cells."""
    frame = trimesh.transformations.random_rotation_matrix(np.random.default_rng(turn).random(3))[:3, :3]
    radius, slope = 0.7, np.tan(np.radians(35))

    def funnel(points: np.ndarray) -> np.ndarray:
        x, y, z = (points @ frame).T
        side = (slope * (np.hypot(x, y) - radius) - z) * np.cos(np.arctan(slope))
        return np.maximum(z, side)

    mesh = mesh_field(funnel, LOW, HIGH, 40)
    assert_closed(mesh)
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    rim = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) @ frame.T
    off = trimesh.proximity.closest_point(mesh, rim)[1] / (2 / 40)
    assert off.max() < 0.6
    assert off.mean() < 0.06
    assert mesh.volume == pytest.approx(np.pi * radius**3 * slope / 3, rel=4e-3)
    assert mesh.area == pytest.approx(np.pi * radius**2 * (1 + np.hypot(1, slope)), rel=0.02)


def test_faces_exactly_on_the_lattice() -> None:
    """A box whose faces fall on corners of a lattice over the same bounds, with values of exactly zero."""
    mesh = mesh_field(box((0.5, 0.5, 0.5)), LOW, HIGH, 16)
    assert_closed(mesh)
    assert mesh.volume == pytest.approx(1.0, rel=1e-3)


def test_touching_boxes_stay_a_manifold() -> None:
    first, second = box((0.2, 0.2, 0.2), (0.2, 0.2, 0.2)), box((0.2, 0.2, 0.2), (-0.2, -0.2, 0.2))
    mesh = mesh_field(lambda p: np.minimum(first(p), second(p)), LOW, HIGH, 40)
    assert_closed(mesh)
    assert mesh.volume == pytest.approx(2 * 0.064, rel=0.02)


def test_thin_shell_is_complete() -> None:
    mesh = mesh_field(lambda p: np.abs(sphere(p)) - 0.02, LOW, HIGH, 100)
    assert_closed(mesh)
    assert mesh.euler_number == 4
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * (0.82**3 - 0.78**3), rel=0.01)


def test_surface_that_leaves_the_box_is_followed() -> None:
    mesh = mesh_field(sphere, [-0.5] * 3, [0.7, 0.5, 0.5], 24)
    assert_closed(mesh)
    assert mesh.bounds == pytest.approx(np.array([[-0.8] * 3, [0.8] * 3]), abs=0.01)


def test_cells_need_not_be_cubes() -> None:
    mesh = mesh_field(box((0.9, 0.9, 0.003)), [-1, -1, -0.01], [1, 1, 0.01], (20, 20, 12))
    assert_closed(mesh)
    assert mesh.volume == pytest.approx(8 * 0.9 * 0.9 * 0.003, rel=0.01)


def test_only_cells_near_the_surface_are_evaluated() -> None:
    count = 0

    def counted(points: np.ndarray) -> np.ndarray:
        nonlocal count
        count += len(points)
        return sphere(points)

    mesh_field(counted, LOW, HIGH, 128, sharp=False)
    assert count < 0.6 * 128**3


def test_same_bytes_twice() -> None:
    one, two = (mesh_field(torus, LOW, HIGH, 24) for _ in range(2))
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.faces.tobytes() == two.faces.tobytes()


@pytest.mark.parametrize("constant", [1.0, -1.0])
def test_no_surface_is_named(constant: float) -> None:
    with pytest.raises(NoSurfaceError):
        mesh_field(lambda p: np.full(len(p), constant), LOW, HIGH, 16)


def test_endless_surface_is_named() -> None:
    with pytest.raises(NoSurfaceError, match="does not close"):
        mesh_field(lambda p: p[:, 2], LOW, HIGH, 16)


def test_not_finite_is_named() -> None:
    with pytest.raises(NotFiniteError):
        mesh_field(lambda p: np.full(len(p), np.nan), LOW, HIGH, 16)


@pytest.mark.parametrize(
    ("low", "high", "resolution"),
    [
        (LOW, LOW, 8),
        (HIGH, LOW, 8),
        ([np.nan] * 3, HIGH, 8),
        (LOW, HIGH, 0),
        (LOW, HIGH, 10**6),
        (LOW, HIGH, (8, 8)),
    ],
)
def test_bad_boxes_are_named(low: list[float], high: list[float], resolution: int) -> None:
    with pytest.raises(SettingError):
        mesh_field(sphere, low, high, resolution)


def test_corners_of_blocks_are_where_the_lattice_is_bit_for_bit() -> None:
    """Else two blocks could disagree about the face that they share."""
    grid = Grid(np.array([-1.037, 0.011, 7.3]), np.array([0.0131, 0.027, 0.0093]), np.full(3, 40))
    blocks = np.random.default_rng(0).integers(-3, 12, (20, 3))
    corners = np.stack(np.meshgrid(*[np.arange(BLOCK + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)

    def distance(points: np.ndarray) -> np.ndarray:
        # Not by a product of matrices: how that rounds a row depends on where the row lies.
        x, y, z = np.moveaxis(points, -1, 0)
        return x + np.float32(0.37) * y - np.float32(0.83) * z

    slow = distance((grid.origin + (blocks[:, None] * BLOCK + corners) * grid.cell).astype(np.float32))
    np.testing.assert_array_equal(block_values(distance, grid, blocks).reshape(slow.shape), slow)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**31), spread=st.floats(0.05, 2.0))
def test_features_are_found_as_by_comparing_all_corners_with_each_other(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    length = rng.integers(3, 7, 200)
    normals = rng.normal(size=(500, 3)) * spread + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    index = rng.integers(0, 500, (200, 6))
    polygons = Polygons(normals, index, length, np.zeros((200, 4, 3), np.int64), np.zeros((200, 3), np.int64))
    slow = [i for i in range(200) if (around := normals[index[i, : length[i]]]).dot(around.T).min() < _SHARP]
    assert _with_features(polygons, normals).tolist() == slow
