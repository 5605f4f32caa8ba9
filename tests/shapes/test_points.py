"""Points in: surfaces of known volume, sides that must be found, and clouds that show nothing."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import box, inverted, sphere, together

from partwright.errors import (
    EmptyShapeError,
    FlatShapeError,
    GridError,
    NeedsSurfaceError,
    NotFiniteError,
    UnreadableFileError,
)
from partwright.shapes import load_shape
from partwright.shapes.indicator import Indicator
from partwright.shapes.normals import normal_lines, orient_normals


def cloud(mesh: trimesh.Trimesh, count: int = 8000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    surface = load_shape(mesh)
    samples = surface.unit_surface(count, seed)
    return surface.frame.from_unit(samples.points), samples.normals.astype(np.float64)


def tee() -> trimesh.Trimesh:
    return together(box((2, 0.6, 0.6)), box((0.5, 0.5, 1.4), (0, 0, 0.8)))


def write_ply(path, points, normals, form) -> None:
    names = ["x", "y", "z"] if normals is None else ["x", "y", "z", "nx", "ny", "nz"]
    rows = (points if normals is None else np.hstack([points, normals])).astype("<f4")
    header = f"ply\nformat {form} 1.0\nelement vertex {len(rows)}\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    text = "\n".join(" ".join(f"{v:.7g}" for v in row) for row in rows) + "\n"
    path.write_bytes(header.encode() + (rows.tobytes() if form.startswith("binary") else text.encode()))


@pytest.mark.parametrize("with_normals", [True, False])
@pytest.mark.parametrize("form", ["ascii.ply", "binary_little_endian.ply", "xyz", "csv.xyz", "npy", "npz"])
def test_every_format_gives_the_same_surface(tmp_path, form, with_normals):
    points, normals = cloud(sphere(2.0, 3), 3000)
    points += [10, 20, 30]
    rows = np.hstack([points, normals]) if with_normals else points
    path = tmp_path / f"ball.{form}"
    if form.endswith("ply"):
        write_ply(path, points, normals if with_normals else None, form.split(".")[0])
    elif form.endswith("xyz"):
        lines = [(", " if form == "csv.xyz" else "\t").join(map(repr, row)) for row in rows.tolist()]
        path.write_text("\n".join(["# a ball", *lines] if form == "csv.xyz" else [str(len(rows)), *lines]))
    elif form == "npy":
        np.save(path, rows.astype(np.float32))
    else:
        np.savez_compressed(path, points=points, **({"normals": normals} if with_normals else {}))
    shape = load_shape(path, unit="mm", up="z")
    assert shape.volume == pytest.approx(4 / 3 * np.pi * 8, rel=0.01)
    np.testing.assert_allclose(shape.frame.centre, (10, 20, 30), atol=0.02)
    assert (shape.name, shape.unit, shape.up) == (path.stem, "mm", "z")
    assert "3000 points" in shape.repairs[0]
    assert any("normals were estimated" in note for note in shape.repairs) != with_normals
    assert shape.confidence > 0.99
    assert trimesh.Trimesh(shape.vertices, shape.faces).is_watertight


@pytest.mark.parametrize("with_normals", [True, False])
def test_sharp_edges_inner_corners_and_distances(with_normals):
    points, normals = cloud(tee(), 20_000)
    true, shape = load_shape(tee()), load_shape(np.hstack([points, normals]) if with_normals else points)
    assert shape.volume == pytest.approx(true.volume, rel=0.015)
    where = np.random.default_rng(0).uniform(-1, 1, (4000, 3)) * [1.1, 0.4, 1.5]
    error = np.abs(shape.signed_distance(where) - true.signed_distance(where))
    assert error.mean() < 0.005
    assert np.quantile(error, 0.99) < 0.025


def test_thin_walls_keep_both_sides_where_normals_are_given():
    """An open tray, its wall two thirds of a spacing thick, which the nearest point's plane alone loses."""
    tray = trimesh.boolean.difference([box((2, 2, 1)), box((1.92, 1.92, 1), (0, 0, 0.04))])
    true = load_shape(tray)
    shape = load_shape(np.hstack(cloud(tray, 5000)))
    assert np.sqrt(true.area / 5000) > 1.3 * 0.04
    where = np.random.default_rng(0).uniform(-1, 1, (20_000, 3)) * [1.1, 1.1, 0.6]
    inside, found = true.signed_distance(where) < 0, shape.signed_distance(where) < 0
    assert (inside & found).sum() > 0.8 * (inside | found).sum()
    assert shape.volume == pytest.approx(true.volume, rel=0.1)


def test_normals_that_face_inwards_are_turned():
    points, normals = cloud(tee())
    shape = load_shape(np.hstack([points, -normals]))
    assert any("faced inwards" in note for note in shape.repairs)
    assert shape.volume == pytest.approx(load_shape(np.hstack([points, normals])).volume, rel=1e-6)


@pytest.mark.parametrize(
    "mesh",
    [
        tee(),
        together(sphere(1.0), inverted(sphere(0.5))),  # a cavity
        together(sphere(1.0), inverted(sphere(0.9))),  # thin walls
        together(box(), box(centre=(1.1, 0, 0))),  # a narrow gap
        box((2, 2, 0.05)),
        trimesh.creation.torus(1.0, 0.3),
    ],
)
def test_estimated_normals_face_outwards(mesh):
    from scipy.spatial import cKDTree

    points, normals = cloud(mesh, 20_000)
    neighbours = cKDTree(points).query(points, 12)[1]
    spacing = float(np.sqrt(load_shape(mesh).area / len(points)))
    found = orient_normals(points, normal_lines(points, neighbours), neighbours, spacing)
    cosine = (found * normals).sum(axis=1)
    assert (cosine > 0).mean() > 0.995
    assert np.median(cosine) > 0.998


@settings(max_examples=10)
@given(seed=st.integers(0, 1000), size=st.floats(1e-5, 1e5))
def test_turning_scaling_and_noise_change_nothing_much(seed, size):
    rng = np.random.default_rng(seed)
    points, _ = cloud(box((1.0, 0.7, 0.5)), 4000, seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    shape = load_shape((points + rng.normal(0, 0.002, points.shape)) @ turn.T * size)
    assert shape.volume == pytest.approx(0.35 * size**3, rel=0.03)
    assert shape.confidence > 0.95


def test_a_missing_cap_is_closed_and_costs_confidence():
    points, _ = cloud(sphere())
    shape = load_shape(points[points[:, 2] > -0.8])
    assert shape.volume == pytest.approx(4 / 3 * np.pi, rel=0.05)
    assert 0.85 < shape.confidence < 0.97


def test_points_at_the_same_place_count_once():
    points, _ = cloud(sphere(), 3000)
    shape = load_shape(np.repeat(points, 3, axis=0))
    assert any("merged 6000 points" in note for note in shape.repairs)
    assert shape.volume == pytest.approx(load_shape(points).volume, rel=1e-3)


def test_very_many_points_are_thinned(monkeypatch):
    monkeypatch.setattr("partwright.shapes.point_cloud._DENSE", 5000)
    monkeypatch.setattr("partwright.shapes.point_cloud._FINEST", 0.04)
    points, normals = cloud(sphere(), 20_000)
    shape = load_shape(np.hstack([points, normals]))
    assert any("merged" in note for note in shape.repairs)
    assert len(shape.faces) < 20_000
    assert shape.volume == pytest.approx(4 / 3 * np.pi, rel=0.01)


def test_colours_are_not_taken_for_normals():
    points, _ = cloud(sphere(), 2000)
    colours = np.random.default_rng(0).integers(0, 256, points.shape)
    shape = load_shape(np.hstack([points, colours]))
    assert any("no unit normals" in note for note in shape.repairs)
    assert shape.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_point_clouds_and_vertices_without_faces_are_points():
    points, _ = cloud(sphere(), 2000)
    volume = load_shape(points).volume
    assert load_shape(trimesh.PointCloud(points)).volume == volume
    assert load_shape((points, np.zeros((0, 3), int))).volume == volume


def test_points_in_a_glb_lie_where_their_nodes_put_them_in_metres(tmp_path):
    points, _ = cloud(trimesh.creation.box((1, 2, 3)))
    scene = trimesh.Scene()
    for x in (0, 4):  # two boxes of one scan, apart, each twice as large
        move = trimesh.transformations.translation_matrix((x, 10, 0)) @ np.diag([2, 2, 2, 1])
        scene.add_geometry(trimesh.PointCloud(points), node_name=f"scan {x}", transform=move)
    scene.export(tmp_path / "scan.glb")
    shape = load_shape(tmp_path / "scan.glb")
    assert (shape.unit, shape.up) == ("m", "y")
    assert shape.points.min(axis=0) == pytest.approx([-1, 8, -3], abs=0.05)
    assert shape.points.max(axis=0) == pytest.approx([5, 12, 3], abs=0.05)


def test_points_beside_a_mesh_are_left_out_and_told(tmp_path):
    scene = trimesh.Scene([trimesh.creation.box((1, 2, 3))])
    scene.add_geometry(trimesh.PointCloud(np.full((700, 3), 5.0)))
    scene.export(tmp_path / "both.glb")
    shape = load_shape(tmp_path / "both.glb")
    assert shape.volume == pytest.approx(6)
    assert any("left out 700 points" in note for note in shape.repairs)


def test_the_same_points_give_the_same_mesh():
    points, _ = cloud(tee())
    first, second = load_shape(points), load_shape(points.copy())
    np.testing.assert_array_equal(first.vertices, second.vertices)
    np.testing.assert_array_equal(first.faces, second.faces)


def test_indicator_is_one_inside_and_zero_outside():
    points, normals = cloud(tee(), 20_000)
    shape = load_shape(tee())
    area = np.full((len(points), 1), shape.area / len(points))
    indicator = Indicator(points, normals * area, 0.03)
    where = np.random.default_rng(0).uniform(-1.2, 1.2, (5000, 3))
    distance = shape.signed_distance(where)
    clear = np.abs(distance) > 0.08
    np.testing.assert_allclose(indicator(where)[clear], distance[clear] < 0, atol=0.08)
    grid = indicator.on_grid(np.array([-1.0, -0.5, -0.5]), 0.1, (20, 10, 20))
    places = np.array([-1.0, -0.5, -0.5]) + 0.1 * np.argwhere(np.ones(grid.shape))
    np.testing.assert_allclose(grid.ravel(), indicator(places), atol=1e-4)


def test_points_that_show_no_inside_are_named():
    rng = np.random.default_rng(0)
    flat = np.hstack([rng.random((500, 2)), np.zeros((500, 1))])
    with pytest.raises(FlatShapeError):
        load_shape(flat)
    with pytest.raises(NeedsSurfaceError, match="bear out"):
        load_shape(np.hstack([rng.random((4000, 2)), 0.002 * rng.normal(size=(4000, 1))]))
    with pytest.raises(FlatShapeError):
        load_shape(np.ones((500, 3)))
    with pytest.raises(NeedsSurfaceError, match="99 points"):
        load_shape(rng.random((99, 3)))
    with pytest.raises(NeedsSurfaceError, match="1 point without faces"):
        load_shape(rng.random((1, 3)))
    with pytest.raises(NeedsSurfaceError, match="2 places"):
        load_shape(np.repeat([[0.0, 0, 0], [1, 1, 1]], 100, axis=0))
    with pytest.raises(NotFiniteError, match="1 of 201"):
        load_shape(np.vstack([rng.random((200, 3)), [[0, np.nan, 0]]]))


@pytest.mark.parametrize("faces", ["", "element face 0\nproperty list uchar int vertex_indices\n"])
def test_a_scan_without_a_point_is_not_told_that_it_lacks_triangles(tmp_path, faces):
    path, axes = tmp_path / "scan.ply", "".join(f"property float {axis}\n" for axis in "xyz")
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex 0\n{axes}{faces}end_header\n")
    with pytest.raises(
        EmptyShapeError, match="scan: holds neither triangles nor points; export the shape again"
    ):
        load_shape(path)


@pytest.mark.parametrize("shape", [(5,), (5, 2), (2, 2, 2, 2)])
def test_arrays_of_another_form_are_named(shape):
    with pytest.raises(GridError, match="expected points"):
        load_shape(np.zeros(shape))


@pytest.mark.parametrize("text", ["1 2\n3 4\n", "1 2 3\n4 5\n", "x y z\n", "1 2 3 \x00\n", "\u2028"])
def test_broken_text_is_named(tmp_path, text):
    path = tmp_path / "cut.xyz"
    path.write_text(text, encoding="utf-8")
    with pytest.raises((UnreadableFileError, EmptyShapeError, GridError)):
        load_shape(path)
