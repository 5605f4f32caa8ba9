"""Surfaces without a thickness that are given one: against solids whose volume is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import box, together, without

from partwright.errors import FlatShapeError, OpenShellError, SettingError
from partwright.shapes import load_shape

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
UP = np.array([0, 0, 1.0])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def strip(*heights: float, width: float = 1.0) -> trimesh.Trimesh:
    """A folded sheet: from one unit along x to the next it climbs to the next height."""
    n = len(heights)
    x = np.arange(n, dtype=float)
    rows = [np.stack([x, np.full(n, y), np.array(heights)], axis=1) for y in (0.0, width)]
    low = np.arange(n - 1)
    faces = np.concatenate(
        [np.stack([low, low + 1, low + 1 + n], axis=1), np.stack([low, low + 1 + n, low + n], axis=1)]
    )
    return trimesh.Trimesh(np.concatenate(rows), faces, process=False)


def test_a_square_becomes_a_plate() -> None:
    with pytest.raises(FlatShapeError, match="--thickness"):
        load_shape((SQUARE, FACES))
    shape = load_shape((SQUARE, FACES), thickness=0.02)
    assert shape.volume == pytest.approx(0.02, rel=1e-6)
    assert shape.bounds() == pytest.approx(np.array([[0, 0, -0.01], [1, 1, 0.01]]), abs=1e-9)
    assert shape.confidence == 1.0
    assert "gave 1 sheet a thickness" in shape.repairs
    assert trimesh.Trimesh(shape.vertices, shape.faces).is_watertight


@given(st.lists(st.floats(-0.6, 0.6), min_size=2, max_size=5), st.floats(0.005, 0.05), st.integers(0, 99))
@settings(max_examples=40, deadline=None)
def test_a_folded_sheet_is_as_thick_across_each_of_its_faces(heights, wall, seed) -> None:
    """Its two sides are parallel to it, so that it has its length by its thickness, whichever way it stands
    and its faces are turned."""
    mesh = strip(*heights)
    rng = np.random.default_rng(seed)
    flipped = rng.random(len(mesh.faces)) < 0.3
    faces = np.where(flipped[:, None], mesh.faces[:, ::-1], mesh.faces)
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    shape = load_shape((mesh.vertices @ turn.T, faces), thickness=wall)
    length = np.hypot(1, np.diff(heights)).sum()
    # What a fold adds on one side it lacks on the other, and at the ends a half of the wall is cut off.
    assert shape.volume == pytest.approx(length * wall, rel=1e-4)
    middles = mesh.triangles_center @ turn.T
    assert shape.signed_distance(middles) == pytest.approx(-wall / 2, abs=1e-4)


def test_a_box_without_a_lid_is_a_tray_and_its_walls_meet() -> None:
    cube = box()
    tray = without(cube, cube.face_normals[:, 2] > 0.9)
    filled, hollow = load_shape(tray), load_shape(tray, thickness="10%")
    assert filled.volume == pytest.approx(1.0)
    assert hollow.volume == pytest.approx(1.1**2 * 1.05 - 0.9**2 * 0.95, rel=1e-6)
    assert hollow.confidence == 1.0
    assert hollow.signed_distance([[0, 0, 0]])[0] == pytest.approx(0.45, abs=1e-6)


def test_a_hemisphere_without_thickness_is_a_bowl() -> None:
    ball = trimesh.creation.icosphere(4)
    cap = without(ball, ball.triangles_center[:, 2] > 0)
    shape = load_shape(cap, thickness=0.04)
    assert shape.volume == pytest.approx(0.04 * cap.area, rel=5e-3)
    assert shape.signed_distance([[0, 0, -0.5]])[0] > 0.4


def test_solids_beside_sheets_stay_as_they_are_and_both_sides_of_a_sheet_are_one() -> None:
    leaf = trimesh.Trimesh(SQUARE + 2 * UP, np.concatenate([FACES, FACES[:, ::-1]]), process=False)
    other = [[0, 1, 3], [1, 2, 3]]  # cut the other way than the side above
    pane = trimesh.Trimesh(SQUARE + 3 * UP, np.concatenate([FACES, np.flip(other, 1)]), process=False)
    scene = together(box(), leaf, pane)
    shape = load_shape(scene)
    assert shape.volume == pytest.approx(1.0)
    assert "left out 1 loose flat sheet" in shape.repairs
    walled = load_shape(scene, thickness=0.01)
    assert walled.volume == pytest.approx(1.02, rel=1e-5)
    assert walled.signed_distance([[0.5, 0.5, 2], [0.5, 0.5, 3]]) == pytest.approx([-0.005] * 2, abs=1e-5)


def test_sheets_that_meet_in_a_tee_are_one_body() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0.5, 0], [1, 0.5, 0], [0, 0.5, 1], [1, 0.5, 1]]
    faces = [[0, 1, 5], [0, 5, 4], [4, 5, 3], [4, 3, 2], [4, 5, 7], [4, 7, 6]]
    shape = load_shape((np.array(points, float), np.array(faces)), thickness=0.02)
    assert shape.volume == pytest.approx(0.02 + 0.02 * 1 - 0.02 * 0.01, rel=1e-3)
    assert len(trimesh.Trimesh(shape.vertices, shape.faces).split()) == 1


def test_each_node_of_a_scene_keeps_the_thickness(tmp_path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(strip(0, 0.3), node_name="bent")
    scene.add_geometry(strip(1, 1), node_name="flat")
    scene.export(tmp_path / "two.glb")
    nodes = load_shape(tmp_path / "two.glb", thickness="20mm").split_nodes()
    assert {node.name: node.volume for node in nodes} == pytest.approx(
        {"bent": 0.02 * np.hypot(1, 0.3), "flat": 0.02}, rel=1e-4
    )


def test_a_shape_that_has_no_sheets_says_so() -> None:
    shape = load_shape(box(), thickness=0.1)
    assert shape.volume == pytest.approx(1.0)
    assert any("none was given a thickness" in note for note in shape.repairs)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (0, "above 0"),
        ("60%", "at most half"),
        (-1, "expected a length"),
        ("thick", "expected a length"),
        ("1mm", "--unit"),
    ],
)
def test_what_is_no_thickness_is_one_line(asked, message) -> None:
    with pytest.raises(SettingError, match=f"thickness: .*{message}"):
        load_shape((SQUARE, FACES), thickness=asked)


def test_an_open_shell_says_what_may_be_done() -> None:
    cube = box()
    tube = without(cube, np.abs(cube.face_normals[:, 2]) > 0.9)
    with pytest.raises(OpenShellError, match="--thickness"):
        load_shape(tube)
    assert load_shape(tube, thickness=0.1).volume == pytest.approx(1.1**2 - 0.9**2, rel=1e-6)


def test_a_body_with_a_small_hole_is_no_shell() -> None:
    ball = trimesh.creation.icosphere(3)
    pierced = without(ball, ball.triangles_center[:, 2] > 0.97)
    sheet = trimesh.Trimesh(SQUARE + 3 * UP, FACES, process=False)
    shape = load_shape(together(pierced, sheet), thickness=0.02)
    assert shape.volume == pytest.approx(ball.volume + 0.02, rel=0.01)
    assert "filled 1 small hole" in shape.repairs
    assert "gave 1 sheet a thickness" in shape.repairs


def test_a_pipe_without_caps_is_a_pipe_however_long() -> None:
    pipe = trimesh.creation.cylinder(0.05, 20, sections=64)
    tube = without(pipe, np.abs(pipe.face_normals[:, 2]) > 0.9)
    assert load_shape(tube, thickness=0.02).volume == pytest.approx(tube.area * 0.02, rel=0.02)


def test_a_ball_with_a_brim_stays_solid() -> None:
    ball = trimesh.creation.icosphere(3)
    flat = np.flatnonzero(np.abs(ball.vertices[:, 2]) < 1e-9)
    ring = flat[np.argsort(np.arctan2(*ball.vertices[flat, :2].T))]
    follow, n = np.roll(np.arange(len(ring)), -1), len(ball.vertices)
    outer = n + np.arange(len(ring))
    brim = np.concatenate(
        [
            np.stack([ring, outer, ring[follow]], axis=1),
            np.stack([ring[follow], outer, outer[follow]], axis=1),
        ]
    )
    mesh = (np.concatenate([ball.vertices, 1.5 * ball.vertices[ring]]), np.concatenate([ball.faces, brim]))
    shape = load_shape(mesh, thickness=0.02)
    area = np.pi * (1.5**2 - 1)
    assert shape.volume == pytest.approx(ball.volume + area * 0.02, rel=0.01)


def test_both_sides_of_a_sheet_are_one_wherever_it_touches() -> None:
    """A leaf that shares a corner with a box, and one whose sides are a hair apart."""
    cube = box((1, 1, 1), (0.5, 0.5, 0.5))
    leaf = np.array([[1, 1, 1], [2, 1, 1], [2, 2, 1], [1, 2, 1]], float)
    both = np.concatenate([FACES, FACES[:, ::-1]])
    at_corner = trimesh.Trimesh(leaf, both, process=False)
    apart = trimesh.Trimesh(
        np.concatenate([SQUARE + 3 * UP, SQUARE + (3 + 2e-6) * UP]),
        np.concatenate([FACES[:, ::-1], FACES + 4]),
        process=False,
    )
    scene = together(cube, at_corner, apart)
    assert load_shape(scene, thickness=0.01).volume == pytest.approx(1.02, rel=2e-3)
    plain = load_shape(scene)
    assert plain.volume == pytest.approx(1.0)
    assert plain.left_out == pytest.approx(2 / 8, abs=0.02)


def test_a_wall_between_two_rooms_is_no_sheet() -> None:
    one, other = box((1, 1, 1), (0, 0, 0)), box((1, 1, 1), (1, 0, 0))
    shape = load_shape(together(one, other), thickness=0.1)
    assert shape.volume == pytest.approx(2.0)
    assert shape.left_out == 0


@pytest.mark.parametrize("number", [np.float32(0.02), np.float64(0.02), 0.02, "0.02", "2%"])
def test_a_thickness_may_be_any_number(number) -> None:
    assert load_shape((SQUARE, FACES), thickness=number).volume == pytest.approx(0.02, rel=1e-5)


def test_the_error_of_a_mesh_without_area_comes_first() -> None:
    with pytest.raises(FlatShapeError, match="one point"):
        load_shape((np.zeros((3, 3)), np.array([[0, 1, 2]])), thickness="1%")
