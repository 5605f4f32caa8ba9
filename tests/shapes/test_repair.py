"""What is repaired, what is only reported, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from solids import box, inverted, sphere, together, without

from partwright.errors import EmptyShapeError, FlatShapeError, OpenShellError
from partwright.shapes import Openings, load_shape, repair


def test_a_sound_mesh_is_used_as_it_is():
    shape = load_shape(box())
    assert shape.repairs == ()
    assert shape.confidence == 1.0
    assert len(shape.faces) == 12


def test_duplicate_vertices_and_triangles_are_merged():
    soup = box().triangles.reshape(-1, 3)
    faces = np.arange(36).reshape(-1, 3)
    shape = load_shape((soup, np.vstack([faces, faces[:2], [[0, 0, 1]]])))
    assert len(shape.vertices) == 8
    assert len(shape.faces) == 12
    assert shape.volume == pytest.approx(1)
    said = " / ".join(shape.repairs)
    assert "merged 28 duplicate vertices" in said
    assert "dropped 1 triangle without area" in said
    assert "dropped 2 duplicate triangles" in said


def test_flipped_triangles_and_inverted_bodies_are_turned():
    flipped = box().faces.copy()
    flipped[3] = flipped[3, ::-1]
    for mesh in ((box().vertices, flipped), inverted(box())):
        shape = load_shape(mesh)
        assert shape.volume == pytest.approx(1)
        assert any("turned 1" in note for note in shape.repairs)


def test_random_winding_is_made_consistent():
    mesh = sphere()
    faces = mesh.faces.copy()
    chosen = np.random.default_rng(0).random(len(faces)) < 0.5
    faces[chosen] = faces[chosen, ::-1]
    assert load_shape((mesh.vertices, faces)).volume == pytest.approx(mesh.volume)


def test_a_two_sided_mesh_keeps_one_side():
    mesh = box()
    shape = load_shape((mesh.vertices, np.vstack([mesh.faces, mesh.faces[:, ::-1]])))
    assert shape.volume == pytest.approx(1)
    assert len(shape.faces) == 12


@pytest.mark.parametrize("whole_inverted", [False, True])
def test_a_nested_cavity_stays_a_cavity(whole_inverted):
    hollow = together(box(), inverted(box((0.5, 0.5, 0.5))))
    shape = load_shape(inverted(hollow) if whole_inverted else hollow)
    assert shape.volume == pytest.approx(0.875)
    np.testing.assert_allclose(shape.signed_distance([[0, 0, 0], [0.375, 0, 0]]), [0.25, -0.125], atol=1e-6)


def test_a_body_inside_a_cavity_counts():
    ball = together(box(), inverted(box((0.8, 0.8, 0.8))), box((0.4, 0.4, 0.4)))
    assert load_shape(ball).volume == pytest.approx(1 - 0.8**3 + 0.4**3)


def test_overlapping_bodies_lose_their_inner_faces():
    shape = load_shape(together(box(), box(centre=(0.5, 0.3, 0.2))))
    assert shape.volume == pytest.approx(2 - 0.5 * 0.7 * 0.8)
    assert any("united 2 bodies" in note for note in shape.repairs)
    # Within the overlap the distance is to the outer surface, not to the faces that the union removed.
    assert shape.signed_distance([[0.499, 0.15, 0.1]])[0] == pytest.approx(-0.35, abs=2e-3)


def test_stacked_boxes_that_share_a_wall_become_one():
    shape = load_shape(together(box(), box(centre=(1, 0, 0))))
    assert shape.volume == pytest.approx(2)
    assert shape.signed_distance([[0.5, 0, 0]])[0] == pytest.approx(-0.5, abs=1e-6)


def test_separate_bodies_stay_separate():
    shape = load_shape(together(box(), box(centre=(3, 0, 0))))
    assert shape.volume == pytest.approx(2)
    assert "2 separate bodies are kept as they are" in shape.repairs


def test_a_hole_is_filled_and_costs_confidence():
    mesh = sphere()
    shape = load_shape(without(mesh, mesh.triangles_center[:, 2] > 0.95))
    assert shape.volume == pytest.approx(mesh.volume, rel=0.02)
    assert any("filled 1 hole" in note for note in shape.repairs)
    assert 0.9 < shape.confidence < 1.0


@pytest.mark.parametrize(
    ("lost", "count"), [("cap", 1), ("crumbs", None)], ids=["one hole", "crumbs all over"]
)
def test_how_much_of_the_surface_was_missing_is_known(lost, count):
    mesh = sphere()
    mesh.apply_translation((10, 0, 0))
    if lost == "cap":
        dropped = mesh.triangles_center[:, 2] > 0.68
    else:
        dropped = np.random.default_rng(0).random(len(mesh.faces)) < 0.16
    openings = load_shape(without(mesh, dropped)).openings
    assert openings.share == pytest.approx(mesh.area_faces[dropped].sum() / mesh.area, abs=0.015)
    if count is not None:
        assert openings.count == count
        assert openings.largest == pytest.approx((10, 0, 0.68), abs=0.02)
    assert load_shape(mesh).openings == Openings()


def test_gaps_between_patches_are_no_missing_surface():
    loose = box().triangles.reshape(-1, 3) + np.repeat(
        np.random.default_rng(0).normal(0, 1e-3, (12, 3)), 3, axis=0
    )
    assert load_shape((loose, np.arange(36).reshape(-1, 3))).openings.share < 0.01


def test_cracks_are_welded():
    loose = box().triangles.reshape(-1, 3) + np.random.default_rng(0).uniform(-2e-6, 2e-6, (36, 3))
    shape = load_shape((loose, np.arange(36).reshape(-1, 3)))
    assert any("along cracks" in note for note in shape.repairs)
    assert shape.volume == pytest.approx(1, rel=1e-4)
    assert shape.confidence == 1.0


def test_loose_patches_go_by_winding_number():
    loose = box().triangles.reshape(-1, 3) + np.repeat(
        np.random.default_rng(0).normal(0, 1e-3, (12, 3)), 3, axis=0
    )
    shape = load_shape((loose, np.arange(36).reshape(-1, 3)))
    assert shape.volume == pytest.approx(1, rel=0.03)
    assert any("generalised winding number" in note for note in shape.repairs)
    occupied = shape.unit_occupancy(64)
    centres = -1 + (np.argwhere(np.ones((64,) * 3)) + 0.5) / 32
    np.testing.assert_array_equal(occupied.ravel(), shape.unit_distance(centres) < 0)


def test_a_surface_through_itself_is_reported_and_keeps_its_outside():
    crossed = trimesh.creation.torus(0.3, 0.5)  # the tube is wider than the ring: it overlaps in the middle
    middle_twice = together(box(), box(centre=(0.5, 0.3, 0.2)))
    bridge = np.vstack([middle_twice.faces, [[0, 8, 1], [1, 8, 0]]])  # ties both bodies, defeats the union
    assert load_shape((middle_twice.vertices, bridge)).volume == pytest.approx(1.72, rel=0.02)
    shape = load_shape(crossed)
    assert 0 < shape.confidence <= 1


@pytest.mark.parametrize("thickness", [1e-2, 1e-3, 1e-4])
def test_thin_closed_walls_survive(thickness):
    shape = load_shape(box((1, 1, thickness)))
    assert shape.volume == pytest.approx(thickness)
    assert shape.signed_distance([[0.1, 0.1, 0]])[0] == pytest.approx(-thickness / 2, rel=1e-2)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_plane_is_flat(turn):
    plane = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    plane.apply_transform(trimesh.transformations.rotation_matrix(turn, [1, 2, 3]))
    with pytest.raises(FlatShapeError):
        load_shape(plane)


def test_degenerate_triangles_only():
    with pytest.raises(FlatShapeError):
        load_shape(([[0, 0, 0], [1, 0, 0]], [[0, 1, 1]]))
    points = np.random.default_rng(0).random((4, 3))
    with pytest.raises(EmptyShapeError):
        load_shape((points, [[0, 1, 1], [2, 2, 3]]))


def test_open_shells_are_refused():
    mesh = sphere()
    with pytest.raises(OpenShellError, match="thickness"):
        load_shape(without(mesh, mesh.triangles_center[:, 2] > 0))
    fold = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [0, 3, 1]])
    with pytest.raises((OpenShellError, FlatShapeError)):
        load_shape(fold)


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_sizes_do_not_matter(size):
    shape = load_shape(
        together(box((size, size, size)), box((size,) * 3, (0.5 * size, 0.3 * size, 0.2 * size)))
    )
    assert shape.volume == pytest.approx(1.72 * size**3)
    assert shape.signed_distance([[0, 0, 2 * size]])[0] > size


def test_a_surface_that_seems_to_part_nothing_is_kept_whole(monkeypatch):
    """Two boxes with a common edge, were their triangles too close to others to see what is behind them."""
    monkeypatch.setattr(repair, "facing", lambda source, corners: np.zeros(len(corners), dtype=np.int64))
    shape = load_shape(together(box(), box(centre=(1, 1, 0))))
    assert shape.volume == pytest.approx(2)
