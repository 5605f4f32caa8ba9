"""Corners that files join are one, and nothing flat is left between them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Profile, Revolution, Tube
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import mesh_csg
from partwright.meshing.welding import welded


def as_files_join(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    joined = trimesh.Trimesh(np.float32(mesh.vertices), mesh.faces, process=False)
    joined.merge_vertices()
    return joined


def test_triangles_that_lie_back_to_back_go() -> None:
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    skin = box.vertices[box.faces[0]] + 1e-9
    vertices = np.concatenate([box.vertices, skin])
    faces = np.concatenate([box.faces, [[8, 9, 10], [10, 9, 8]]])
    joined, left = welded(vertices, faces)
    assert (len(joined), len(left)) == (8, 12)
    mesh = trimesh.Trimesh(joined, left, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(24.0)


def test_bodies_that_touch_in_an_edge_stay_apart() -> None:
    pair = Part(Box((1.0, 1.0, 1.0))) | Part(Box((1.0, 1.0, 1.0)), (1.0, 1.0, 0.0))
    mesh = mesh_csg(pair)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(2.0, rel=1e-5)


def test_without_corners_in_one_place_nothing_changes() -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    vertices, faces = welded(box.vertices, box.faces)
    np.testing.assert_array_equal(vertices, box.vertices)
    np.testing.assert_array_equal(faces, box.faces)


def test_a_bent_pipe_is_closed_as_files_join_it() -> None:
    """Its bend's end and those of the straight tubes lie in each other but for rounding."""
    ring = Profile(
        Profile.circle(0.2359, (0.7808, 0.0)).outline, (Profile.circle(0.2054, (0.7808, 0.0)).outline,)
    )
    half = np.sqrt(0.5)
    pipe = Assembly(
        (
            Part(Revolution(ring, 90.0), (0.1, -0.1167, 0.1167), (0.5, 0.5, 0.5, 0.5)),
            Part(Tube(0.2359, 0.0305, 1.017), (0.1, 0.3915, 0.8975)),
            Part(Tube(0.2359, 0.0305, 1.017), (0.1, -0.8975, 0.3916), (half, half, 0.0, 0.0)),
        )
    )
    for turned in (pipe, pipe.translated((3.0, 1.0, 2.0))):
        mesh = mesh_assembly(turned, 64)
        joined = as_files_join(mesh)
        assert mesh.is_watertight
        assert joined.is_watertight
        assert joined.volume == pytest.approx(mesh.volume, rel=1e-5)
        assert (mesh.area_faces > 0).all()
