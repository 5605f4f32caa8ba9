from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.shapes import load_shape
from partwright.shapes.distance import MeshDistance
from partwright.shapes.outer_faces import facing, halved, outer_faces
from tests.shapes.solids import box, together

PLATE, BLOCK = (1.8, 1.2, 0.2), 0.1
TOP = 0.1  # the height of the plate's upper face


def plate_with_blocks() -> tuple[trimesh.Trimesh, np.ndarray]:
    """A plate, and blocks sunk half into it at the middle and the corners of one of the two triangles of its
    upper face; and that triangle (3, 3)."""
    plate = box(PLATE)
    upper = plate.triangles[np.flatnonzero(plate.face_normals[:, 2] > 0.9)[0]]
    middle = upper.mean(axis=0)
    places = [middle, *(0.85 * upper + 0.15 * middle)]
    return together(plate, *(box((BLOCK,) * 3, place) for place in places)), upper


def test_what_shows_of_a_face_that_is_covered_in_the_middle_and_at_its_corners_is_surface() -> None:
    mesh, upper = plate_with_blocks()
    source = MeshDistance(mesh.vertices, mesh.faces, mesh.faces, closed=True)
    assert facing(source, upper[None])[0] == 0  # where it is looked at first, it is covered
    found = outer_faces(source, np.asarray(mesh.vertices), np.asarray(mesh.faces))
    # The blocks' lower faces; both triangles of the upper face, and all sides of blocks.
    assert (found.hidden, found.cut) == (4 * 2, 2 + 4 * 8)
    outer = trimesh.Trimesh(found.vertices, found.faces, process=False)
    shown = np.prod(PLATE[:2]) * 2 + 2 * PLATE[2] * sum(PLATE[:2]) + 4 * 4 * BLOCK * BLOCK / 2
    assert outer.area == pytest.approx(shown, rel=0.05)
    flat = (np.abs(outer.triangles[:, :, 2] - TOP) < 1e-9).all(axis=1)
    assert outer.area_faces[flat].sum() == pytest.approx(np.prod(PLATE[:2]) - 4 * BLOCK**2, rel=0.05)
    # All of it faces outwards, and hardly any of it is within.
    beside = outer.triangles_center + 1e-3 * outer.face_normals
    inside = source.inside(np.concatenate([beside, beside - 2e-3 * outer.face_normals])).reshape(2, -1)
    assert outer.area_faces[(inside[0] == 0) & inside[1]].sum() > 0.97 * outer.area


def test_distances_are_to_what_shows_of_such_a_face() -> None:
    mesh, upper = plate_with_blocks()
    # Gaps between all triangles keep the surface open, so that the winding number tells the inside.
    middles = mesh.triangles.mean(axis=1, keepdims=True)
    loose = (middles + 0.999 * (mesh.triangles - middles)).reshape(-1, 3)
    shape = load_shape((loose, np.arange(len(loose)).reshape(-1, 3)))
    assert any("only pieces are outside" in note for note in shape.repairs)
    bare = upper.mean(axis=0) + 0.2 * (upper[0] - upper.mean(axis=0))
    above = bare + np.array([[0, 0, 0.01], [0, 0, -0.01]])
    assert shape.signed_distance(above) == pytest.approx([0.01, -0.01], abs=1e-4)


def test_triangles_that_part_all_over_stay_whole() -> None:
    mesh = box()
    source = MeshDistance(mesh.vertices, mesh.faces, mesh.faces, closed=True)
    inverted = np.asarray(mesh.faces)[:, ::-1]
    found = outer_faces(source, np.asarray(mesh.vertices), inverted)
    assert np.array_equal(found.vertices, mesh.vertices)
    assert np.array_equal(found.faces, mesh.faces)  # turned to face outwards
    assert (found.hidden, found.cut) == (0, 0)


def test_halves_cover_a_triangle_and_share_the_middle_of_its_longest_side() -> None:
    vertices = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0]], float)
    faces = np.array([[0, 1, 2], [3, 2, 1]])
    points, halves = halved(vertices, faces)
    assert len(points) == 5  # both have the middle of the side that they share
    corners = points[halves]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert normals == pytest.approx(np.tile([0, 0, 1.0], (4, 1)))
    assert (halves.reshape(2, -1) == 4).sum(axis=1).tolist() == [2, 2]
