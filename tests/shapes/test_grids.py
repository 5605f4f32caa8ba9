"""Voxel and distance grids in: volumes, thin walls, places, and hostile files."""

from __future__ import annotations

import contextlib
import struct
import zipfile

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy import ndimage
from solids import box_distance

from partwright.errors import (
    EmptyShapeError,
    GridError,
    NeedsSurfaceError,
    NotFiniteError,
    PartwrightError,
    UnreadableFileError,
)
from partwright.shapes import load_shape
from partwright.shapes.contour import contour
from partwright.shapes.grid import DistanceGrid
from partwright.shapes.topology import EdgeTable, signed_volumes

CENTRES = np.stack(np.meshgrid(*[np.arange(48) - 23.5] * 3, indexing="ij"), axis=-1)
BALL = np.linalg.norm(CENTRES, axis=-1) - 15.3
BALL_VOLUME = 4 / 3 * np.pi * 15.3**3


def binvox(filled: np.ndarray, translate=(0.0, 0.0, 0.0), scale=1.0) -> bytes:
    x, y, z = filled.shape
    runs = b"".join(bytes([int(v), 1]) for v in filled.transpose(0, 2, 1).ravel())
    place = " ".join(map(str, translate))
    return f"#binvox 1\ndim {x} {z} {y}\ntranslate {place}\nscale {scale}\ndata\n".encode() + runs


@pytest.mark.parametrize(
    ("grid", "tolerance"),
    [
        (BALL, 0.004),
        (-BALL, 0.004),
        (BALL.astype(np.float32), 0.004),
        (np.clip(BALL, -2, 2), 0.004),
        (np.round(BALL * 10).astype(np.int32), 0.01),
        (BALL < 0, 0.01),
        ((BALL < 0).astype(np.uint8) * 255, 0.01),
        ((BALL < 0).astype(np.float32), 0.01),
        (np.clip(0.5 - BALL, 0, 1), 0.01),
    ],
)
def test_every_kind_of_grid_gives_the_ball(grid, tolerance):
    shape = load_shape(grid)
    assert shape.volume == pytest.approx(BALL_VOLUME, rel=tolerance)
    assert shape.area == pytest.approx(4 * np.pi * 15.3**2, rel=0.02)  # stairs would have half as much again
    np.testing.assert_allclose(shape.frame.centre, [23.5] * 3, atol=0.05)
    assert "48 x 48 x 48" in shape.repairs[0]
    assert shape.confidence == 1.0
    assert trimesh.Trimesh(shape.vertices, shape.faces).is_watertight


def test_distances_follow_the_grid():
    turned = CENTRES.reshape(-1, 3) @ trimesh.transformations.rotation_matrix(0.5, (1, 2, 3))[:3, :3]
    half = np.array([16.0, 9.0, 5.0])
    exact = box_distance(turned, half)
    for grid, most in ((exact, 0.05), (exact < 0, 0.25)):
        shape = load_shape(grid.reshape(BALL.shape))
        near = np.abs(exact) < 2
        error = shape.signed_distance(CENTRES.reshape(-1, 3)[near] + 23.5) - exact[near]
        assert np.abs(error).mean() < most
        assert abs(error.mean()) < 0.08


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_every_voxel_centre_stays_on_its_side(seed):
    rng = np.random.default_rng(seed)
    filled = rng.random((9, 10, 11)) < 0.3
    filled[4, 4, 4] = True
    vertices, faces = contour(*_smoothed(filled))
    tree = trimesh.Trimesh(vertices, faces, process=False)
    assert not EdgeTable(faces).balance.any()
    from partwright.shapes.winding import winding_grid

    inside = winding_grid(tree.vertices, np.asarray(tree.faces), (0, 0, 0), 1.0, filled.shape) > 0
    np.testing.assert_array_equal(inside, filled)


def _smoothed(filled):
    from partwright.shapes.voxels import _smooth

    return _smooth(np.pad(filled, 4)), (-4, -4, -4), 1.0


@pytest.mark.parametrize("thickness", [1, 2, 3])
def test_thin_plates_keep_their_thickness(thickness):
    filled = np.zeros((40, 40, 12), dtype=bool)
    filled[5:35, 5:35, 4 : 4 + thickness] = True
    shape = load_shape(filled)
    assert shape.volume == pytest.approx(900 * thickness, rel=0.05)
    inside = shape.signed_distance([[20, 20, 3.5 + thickness / 2]])[0]
    assert inside == pytest.approx(-thickness / 2, abs=0.1)


def test_a_shape_at_the_border_is_closed_there():
    filled = np.zeros((20, 20, 20), dtype=bool)
    filled[:10] = True
    for grid in (filled, np.where(filled, -1.0, 1.0)):
        shape = load_shape(grid)
        assert any("border" in note for note in shape.repairs)
        assert shape.volume == pytest.approx(10 * 20 * 20, rel=0.03)


def test_origin_and_spacing_place_the_grid(tmp_path):
    for key, grid in (("sdf", BALL), ("occupancy", BALL < 0)):
        path = tmp_path / f"{key}.npz"
        np.savez_compressed(path, **{key: grid}, origin=[10, 20, 30], spacing=0.5)
        shape = load_shape(path)
        np.testing.assert_allclose(shape.frame.centre, np.array([10, 20, 30]) + 0.5 * 23.5, atol=0.03)
        assert shape.volume == pytest.approx(BALL_VOLUME / 8, rel=0.01)
    np.savez(path, sdf=BALL, spacing=[1, 2, 3])
    np.testing.assert_allclose(
        np.ptp(load_shape(path).vertices, axis=0), 30.6 * np.array([1, 2, 3]), rtol=0.01
    )
    np.savez(path, BALL)
    assert load_shape(path).volume == pytest.approx(BALL_VOLUME, rel=0.004)


def test_binvox_axes_place_and_size(tmp_path):
    filled = np.zeros((8, 8, 8), dtype=bool)
    filled[1:7, 2:5, 3:5] = True
    path = tmp_path / "brick.binvox"
    path.write_bytes(binvox(filled, (10, 20, 30), 16.0))
    shape = load_shape(path)
    np.testing.assert_allclose(shape.vertices.min(axis=0), [12, 24, 36], atol=0.7)
    np.testing.assert_allclose(shape.vertices.max(axis=0), [24, 30, 40], atol=0.7)


@pytest.mark.parametrize(
    "grid", [np.ones((8, 8, 8), bool), np.zeros((8, 8, 8), bool), np.full((8, 8, 8), -1.0), BALL + 30]
)
def test_grids_without_a_surface_are_named(grid):
    with pytest.raises(GridError):
        load_shape(grid)


def test_other_broken_grids_are_named(monkeypatch):
    with pytest.raises(NotFiniteError):
        load_shape(np.where(BALL < -10, np.nan, BALL))
    with pytest.raises(GridError, match="expected a grid"):
        load_shape(np.zeros((1, 8, 8)))
    with pytest.raises(GridError, match="complex"):
        load_shape(BALL.astype(complex))
    with monkeypatch.context() as patch:
        patch.setattr("partwright.shapes.voxels._MOST_CROSSED", 100)
        with pytest.raises(GridError, match=r"passes [0-9,]+ cells of the .* grid, as noise does"):
            load_shape(BALL)
    monkeypatch.setattr("partwright.shapes.voxels.MOST_CELLS", 1000)
    with pytest.raises(GridError, match="too large"):
        load_shape(BALL)


@pytest.mark.parametrize(
    ("arrays", "error", "words"),
    [
        ({"a": BALL, "b": BALL}, GridError, "a, b"),
        ({"sdf": BALL, "spacing": [1, 2]}, GridError, "spacing"),
        ({"sdf": BALL, "spacing": 0.0}, GridError, "above 0"),
        ({"sdf": BALL, "origin": ["a"]}, UnreadableFileError, "numbers"),
        ({"sdf": BALL < 0}, GridError, "signed numbers"),
        ({"occupancy": BALL}, GridError, "0 .empty. to 1"),
        ({"occupancy": BALL[0]}, GridError, "expected a grid"),
        ({"points": BALL}, NeedsSurfaceError, "expected .N, 3."),
        ({"points": BALL[0][:, :3], "normals": BALL[0][:5, :3]}, NeedsSurfaceError, "same shape"),
        ({"sdf": np.array([{}], dtype=object)}, UnreadableFileError, "object"),
    ],
)
def test_npz_contents_are_checked(tmp_path, arrays, error, words):
    path = tmp_path / "odd.npz"
    np.savez(path, **arrays)
    with pytest.raises(error, match=words):
        load_shape(path)


def npy_header(shape: str, dtype: str = "<f8") -> bytes:
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


@pytest.mark.parametrize("shape", ["(1000000000000, 3)", "(-5, 3)", "(-5, -3)", "(100, 3)", "('a', 3)"])
def test_npy_headers_that_lie_are_refused(tmp_path, shape):
    path = tmp_path / "lie.npy"
    path.write_bytes(npy_header(shape) + b"\0" * 100)
    with pytest.raises(UnreadableFileError):
        load_shape(path)


def test_npz_bombs_are_refused_before_they_unpack(tmp_path, monkeypatch):
    monkeypatch.setattr("partwright.shapes.array_files._LARGEST", 10_000)
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, points=np.zeros((10_000, 3)))
    with pytest.raises(UnreadableFileError, match="unpack"):
        load_shape(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("points.npy", npy_header("(100000000000, 3)") + b"\0" * 1000)
    with pytest.raises(UnreadableFileError, match="claims"):
        load_shape(path)


@pytest.mark.parametrize(
    "data",
    [
        b"#binvox 1\ndim 1000000000 1000000000 1000000000\ntranslate 0 0 0\nscale 1\ndata\n\x01\xff",
        b"#binvox 1\ndim 100 100 100\ntranslate 0 0 0\nscale 1\ndata\n\x01\xff",
        b"#binvox 1\ndim 4 4 4\ntranslate 0 0 0\nscale 1\ndata\n" + b"\x01\x41",
        b"#binvox 1\ndim 4 4 4\ntranslate 0 0 nan\nscale 1\ndata\n" + b"\x01\x40",
        b"#binvox 1\ndim 4 4 4\nscale -1\ndata\n" + b"\x01\x40",
        b"#binvox 1\ndim 0 4 4\ndata\n",
        b"#binvox 1\ndim 4 4 4\nscale\ndata\n" + b"\x01\x40",
        b"#binvox 1\ndim a b\ndata\n",
        b"#binvox 1\n",
        b"\xff" * 2000,
    ],
)
def test_binvox_files_that_lie_are_refused(tmp_path, data):
    path = tmp_path / "lie.binvox"
    path.write_bytes(data)
    with pytest.raises(UnreadableFileError):
        load_shape(path)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1), byte=st.integers(0, 255), suffix=st.sampled_from([".npy", ".npz", ".binvox"]))
def test_one_broken_byte_never_escapes_as_a_library_error(tmp_path, place, byte, suffix):
    filled = np.zeros((6, 6, 6), dtype=bool)
    filled[1:5, 1:5, 1:5] = True
    path = tmp_path / f"bit{suffix}"
    if suffix == ".binvox":
        path.write_bytes(binvox(filled))
    else:
        {".npy": np.save, ".npz": np.savez_compressed}[suffix](path, filled)
    data = bytearray(path.read_bytes())
    data[min(int(place * len(data)), len(data) - 1)] = byte
    path.write_bytes(data)
    with contextlib.suppress(PartwrightError):
        load_shape(path)


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".binvox", ".xyz"])
def test_missing_and_empty_files_are_named(tmp_path, suffix):
    with pytest.raises(UnreadableFileError, match="no such file"):
        load_shape(tmp_path / f"none{suffix}")
    (tmp_path / f"zero{suffix}").touch()
    with pytest.raises(EmptyShapeError):
        load_shape(tmp_path / f"zero{suffix}")


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_contours_of_any_values_are_closed_and_face_outwards(seed):
    rng = np.random.default_rng(seed)
    values = np.pad(np.round(rng.normal(size=(6, 7, 8)), 1), 1, constant_values=1.0)
    vertices, faces = contour(values, (1, 2, 3), (0.5, 1, 2))
    edges = EdgeTable(faces)
    assert not edges.balance.any()
    assert edges.valence.max() == 2
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    assert signed_volumes(vertices, faces, np.zeros(len(faces), np.int64))[0] > 0


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), flat=st.booleans())
def test_a_grid_is_read_as_scipy_reads_it(seed: int, flat: bool) -> None:
    rng = np.random.default_rng(seed)
    counts = (4, 1 if flat else 3, 6)
    grid = DistanceGrid(rng.normal(size=3), 0.3, rng.normal(size=counts).astype(np.float32))
    end = grid.origin + grid.spacing * (np.array(counts) - 1)
    points = rng.uniform(grid.origin - 0.5, end + 0.5, (200, 3))
    points[:2] = grid.origin, end
    place = (points - grid.origin) / grid.spacing
    within = np.clip(place, 0, np.array(counts) - 1)
    read = ndimage.map_coordinates(grid.values.astype(np.float64), within.T, order=1, mode="nearest")
    away = grid.spacing * np.linalg.norm(place - within, axis=1)
    np.testing.assert_allclose(grid.read(points), read + away, rtol=1e-12, atol=1e-12)
