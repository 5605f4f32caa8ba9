"""Convex solids that contain triangles exactly, without growing more than they must."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, OpType

from partwright.approximation.hull_faces import faces_of
from partwright.assembly import Part
from partwright.fields import Box
from partwright.meshing.manifolds import surface_of
from partwright.robots import CollideOptions, collide, save
from partwright.robots.containment import sticking_out
from partwright.robots.enclosing import containing, nearest_hulls, outer_hull
from partwright.robots.model import Shape
from partwright.robots.solids import Target
from tests.robots.robots import urdf


def inside(hulls: list[Manifold], triangles: np.ndarray) -> bool:
    """Whether every one of many points of the triangles is in one of the hulls."""
    weights = np.random.default_rng(5).dirichlet((1, 1, 1), 4000)
    points = np.einsum("nk,tkj->tnj", weights, triangles).reshape(-1, 3)
    outside = [(points @ normals.T - offsets).max(axis=1) for normals, offsets in map(faces_of, hulls)]
    return bool(np.min(outside, axis=0).max() <= 1e-12)


def cube(*lower: float) -> Manifold:
    return Manifold.cube((1, 1, 1)).translate(lower)


def test_a_triangle_that_runs_from_one_cube_into_the_next_adds_next_to_nothing() -> None:
    cubes = [cube(0, 0, 0), cube(1, 0, 0)]
    across = np.array([[[0.1, 0.1, 0.5], [1.9, 0.1, 0.5], [1.0, 0.9, 0.5]]])
    found = containing(cubes, across, 0.01)
    assert inside(found, across)
    assert sum(one.volume() for one in found) <= 2.02
    assert Manifold.batch_boolean(found, OpType.Add).volume() == pytest.approx(2.0, abs=1e-9)


def test_what_is_far_off_joins_the_nearest() -> None:
    cubes = [cube(0, 0, 0), cube(5, 0, 0)]
    apart = np.array(
        [[[1.0, 0, 0], [1.0, 1, 0], [1.5, 0.5, 0.5]], [[0.2, 0.2, 0.2], [0.8, 0.2, 0.2], [0.2, 0.8, 0.2]]]
    )
    found = containing(cubes, apart, 0.05)
    assert inside(found, apart)
    assert found[1] is cubes[1]
    assert found[0].volume() == pytest.approx(1 + 0.5 / 6 * 2, abs=0.08)


@pytest.mark.parametrize("seed", range(2))
def test_triangles_at_random_are_contained(seed: int) -> None:
    random = np.random.default_rng(seed)
    balls = [Manifold.sphere(0.6, 24).translate(tuple(random.uniform(-1, 1, 3))) for _ in range(4)]
    triangles = random.uniform(-1.2, 1.2, (20, 3, 3))
    assert inside(containing(balls, triangles, 0.05), triangles)


def test_an_outer_hull_contains_with_few_faces() -> None:
    ball = Manifold.sphere(1.0, 96).rotate((10, 20, 30))
    outer = outer_hull(ball, 0.02, 64, 1e-6)
    assert (ball - outer).volume() < 1e-12
    assert outer.num_vert() <= 2 * 64 - 4 < ball.num_vert() / 10
    assert outer.volume() < 1.1 * ball.volume()
    corners = surface_of(outer_hull(ball, 0.02, 64, 1e-6, farthest=0.04))[0]
    assert np.linalg.norm(surface_of(outer)[0], axis=1).max() > 1.05
    assert np.linalg.norm(corners, axis=1).max() < 1.041
    turned = cube(0, 0, 0).rotate((10, 20, 30))
    exact = outer_hull(turned, 0.1, 64, 1e-9)
    assert exact.volume() == pytest.approx(1.0, rel=1e-6)
    assert exact.num_vert() == 8


@pytest.mark.parametrize("enclose", [pytest.param(False, marks=pytest.mark.heavy), True])
def test_hulls_are_closed_and_convex_in_files_of_single_precision(tmp_path: Path, enclose: bool) -> None:
    path = urdf(tmp_path / "in")
    ball = trimesh.creation.icosphere(2, 0.02)
    half = trimesh.creation.box((1, 1, 1), transform=trimesh.transformations.translation_matrix((0, 0, 0.5)))
    bowl = trimesh.boolean.difference([ball, trimesh.creation.icosphere(2, 0.015), half])
    bowl.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (0.1, 0.2, 0)))
    bowl.export(tmp_path / "in" / "meshes" / "rod.stl")
    options = CollideOptions(enclose=enclose, tolerance="2mm", kinds=("hull",), max_parts=16)
    save(collide(path, options), tmp_path / "out")
    files = list((tmp_path / "out" / "collision").glob("arm*.stl"))
    assert len(files) > 4
    for file in files:
        mesh = trimesh.load_mesh(file, process=False)
        corners, faces = np.unique(mesh.vertices, axis=0, return_inverse=True)
        read = trimesh.Trimesh(corners, faces.reshape(-1, 3), process=False)
        assert read.is_watertight, file.name
        assert read.is_convex, file.name


def test_the_nearest_hull_is_the_one_that_all_planes_tell() -> None:
    """Whether some planes already tell it or not."""
    random = np.random.default_rng(0)
    balls = [Manifold.sphere(0.5, 24).translate(tuple(random.uniform(-1, 1, 3))) for _ in range(5)]
    planes = [*map(faces_of, balls), faces_of(Manifold.tetrahedron())]
    triangles = random.uniform(-2, 2, (300, 1, 3)) + random.normal(0, 0.2, (300, 3, 3))
    all_of_them = np.stack(
        [(triangles @ normals.T - offsets).max(axis=2).max(axis=1) for normals, offsets in planes]
    )
    owner, beyond = nearest_hulls(planes, triangles)
    assert (owner == all_of_them.argmin(axis=0)).all()
    assert np.allclose(beyond, all_of_them.min(axis=0), atol=1e-12)


def test_enclosing_adds_no_more_than_pieces_do(tmp_path: Path) -> None:
    """A bowl with a rim: its hull adds half as much again; pieces of it less, and none is moved out."""
    path = urdf(tmp_path)
    ball = [trimesh.creation.icosphere(3, radius) for radius in (0.5, 0.42)]
    half = trimesh.creation.box((2, 2, 2), transform=trimesh.transformations.translation_matrix((0, 0, 1)))
    bowl = trimesh.boolean.difference([ball[0], ball[1], half])
    bowl.apply_translation((0, 0, 5))  # clear of the base
    bowl.export(tmp_path / "meshes" / "rod.stl")
    options = CollideOptions(enclose=True, tolerance="20mm", max_parts=12, kinds=("hull",))
    arm = next(link for link in collide(path, options).links if link.link == "arm")
    assert arm.sticking_out == 0
    assert arm.missing < 1e-3
    assert arm.extra < 0.6 * (bowl.convex_hull.volume / bowl.volume - 1)


@pytest.mark.parametrize(("beyond", "told"), [(0.0, 0.0), (1e-8, 0.0), (1e-6, 1e-6)])
def test_what_single_precision_cannot_tell_does_not_stick_out(beyond: float, told: float) -> None:
    """Meshes are written by numbers with 3e-8 between them there."""
    box = Shape("box", part=Part(Box((0.6, 0.6, 0.6))))
    corners = np.array([[0.3 + beyond, 0, 0], [0, 0.3, 0], [0, 0, 0.3]])
    solid = Manifold.cube((0.6, 0.6, 0.6), True)
    target = Target(solid, solid, corners, np.array([[0, 1, 2]]), ())
    assert sticking_out([box], target) == pytest.approx(told, abs=1e-12)
