"""CAPRI-Net's measures on cases that can be worked out by hand."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Quadric, Sphere
from partwright.metrics import cad_scores, evaluate
from partwright.metrics.cad import _sample
from partwright.metrics.chamfer import chamfer
from partwright.metrics.complexity import convexes, distinct_primitives, primitives
from partwright.metrics.edge_chamfer import edge_chamfer, near_edges
from partwright.metrics.light_field import _turns, _zernike, descriptors, light_field_distance
from partwright.metrics.normal_consistency import normal_consistency
from partwright.shapes import load_shape

SPHERE = trimesh.creation.icosphere(4, 0.9)
CUBE = trimesh.creation.box((1.2, 1.2, 1.2))


def turned(mesh: trimesh.Trimesh, degrees: float, axis: tuple[float, float, float]) -> trimesh.Trimesh:
    turn = trimesh.transformations.rotation_matrix(math.radians(degrees), axis)
    return mesh.copy().apply_transform(turn)


def test_normals_of_spheres_agree_and_of_tilted_planes_by_the_cosine() -> None:
    assert normal_consistency(*_sample(SPHERE, 8000, 0), *_sample(SPHERE, 8000, 1)) > 0.999
    points = np.random.default_rng(0).uniform(-1, 1, (2000, 3)) * (1, 1, 0)
    up = np.tile([0.0, 0, 1], (2000, 1))
    tilted = np.tile([math.sin(0.5), 0, -math.cos(0.5)], (2000, 1))
    assert normal_consistency(points, up, points, tilted) == pytest.approx(math.cos(0.5))


def test_edges_of_a_cube_are_found_and_spheres_have_none() -> None:
    points, normals = _sample(CUBE, 30_000, 0)
    near = near_edges(points, normals)
    to_edge = np.sort(0.6 - np.abs(points), axis=1)[:, 1]  # the second nearest face is that far
    assert (to_edge[near] < 0.018).all()
    assert near[to_edge < 0.002].mean() > 0.8
    assert near_edges(points, normals, 0.04)[to_edge < 0.002].mean() > 0.99
    ball = _sample(SPHERE, 8000, 0)
    assert not near_edges(*ball).any()
    assert edge_chamfer(*ball, *_sample(SPHERE, 8000, 1)) == 0
    assert edge_chamfer(*ball, points, normals) == math.inf


def test_the_edge_chamfer_of_a_moved_cube_is_that_of_its_edges() -> None:
    move = np.array([0.0, 0.0, 0.3])
    moved = CUBE.copy()
    moved.apply_translation(move)
    here, there = _sample(CUBE, 30_000, 0), _sample(moved, 30_000, 2)
    along = np.linspace(-0.6, 0.6, 500)
    ends = [(u, v) for u in (-0.6, 0.6) for v in (-0.6, 0.6)]
    lines = [
        np.roll(np.column_stack([along, *np.full((500, 2), e).T]), k, axis=1) for e in ends for k in range(3)
    ]
    edges = np.concatenate(lines)
    # The samples lie in a band around the edges, so those between the two cubes are a little nearer.
    assert edge_chamfer(*there, *here) == pytest.approx(chamfer(edges + move, edges), rel=0.15)


def test_the_light_field_sees_shape_alone() -> None:
    assert len({tuple(turn) for turn in _turns()}) == 60
    assert all(sorted(turn) == list(range(10)) for turn in _turns())
    long = trimesh.creation.box((1.8, 0.6, 0.3))
    assert light_field_distance(long, long) == 0
    moved = long.copy()
    moved.apply_scale(3.0)
    moved.apply_translation((5.0, 2.0, 1.0))
    assert light_field_distance(long, moved) < 60
    # A third of a turn about (1, 1, 1) takes the dodecahedron to itself.
    assert light_field_distance(long, turned(long, 120, (1, 1, 1))) < 60
    flatter = trimesh.creation.box((1.8, 0.6, 0.25))
    assert 60 < light_field_distance(long, flatter) < light_field_distance(long, CUBE)
    assert light_field_distance(long, CUBE) == light_field_distance(CUBE, long) > 1000


def test_a_spheres_silhouettes_are_discs() -> None:
    found = descriptors(SPHERE)
    assert np.ptp(found, axis=0).max() <= 8
    # Of a full disc every moment but the constant is 0 (Zernike's polynomials are orthogonal).
    assert found.max() <= 8
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    radius = np.sqrt((np.arange(400) + 0.5) / 400)
    rho, theta = (a.ravel() for a in np.meshgrid(radius, angle, indexing="ij"))
    assert np.abs(_zernike(rho, theta)).max() < 1e-4


def test_counts_of_primitives_and_convexes() -> None:
    convex = Assembly(tuple(Part(Quadric.plane(n, 1)) for n in np.eye(3)), "intersection")
    tree = Assembly((convex, convex, Part(Sphere(1.0)))) - (convex | convex)
    assert (primitives(tree), convexes(tree)) == (13, 5)
    drilled = Assembly((convex - Part(Quadric.cylinder(0.1)), Part(Box((1, 1, 1)))), "intersection")
    assert convexes(drilled) == 2


def test_a_quadric_that_convexes_share_is_one_primitive() -> None:
    field = Quadric.cylinder(0.3, (0, 1, 2), (0.1, 0, 0))
    moved = Quadric.cylinder(0.3, (0, 1, 2)), (0.1, 0.0, 0.0)
    shared = [
        Part(field),
        Part(field.complement()),
        Part(*moved),
        Part(Quadric(tuple(3 * c for c in field.coefficients))),
    ]
    planes = [Part(Quadric.plane(n, 1)) for n in (*np.eye(3), -np.eye(3)[0])]
    tree = Assembly(
        (Assembly((*shared[:2], *planes), "intersection"), Assembly(tuple(shared[2:])), Part(Sphere(1.0)))
    )
    assert distinct_primitives(tree) == 1 + 4 + 1
    assert distinct_primitives(Part(field)) == distinct_primitives(Part(Sphere(1.0))) == 1


def test_all_scores_of_a_perfect_cube_and_of_one_with_a_hole() -> None:
    shape = load_shape(trimesh.creation.box((2.0, 2.0, 2.0)))
    cube = Assembly((Part(Box((2.0, 2.0, 2.0))),))
    scores = cad_scores(cube, shape, points=8000)
    assert scores.points == 8000
    assert evaluate(cube, shape, emd=False, cad_points=8000).cad == scores
    assert scores.chamfer == pytest.approx(scores.chamfer_floor, rel=0.05)
    assert scores.normal_consistency == pytest.approx(scores.normal_consistency_floor, abs=0.01)
    assert scores.normal_consistency > 0.95
    assert scores.edge_chamfer == pytest.approx(scores.edge_chamfer_floor, rel=0.3)
    assert scores.light_field_distance < 30
    worse = cad_scores(cube - Part(Sphere(0.7), (0, 0, 1.0)), shape, points=8000)
    assert worse.chamfer > 2 * scores.chamfer
    assert worse.normal_consistency < scores.normal_consistency - 0.02
    assert (worse.primitives, worse.convexes) == (2, 2)
    ball = cad_scores(Assembly((Part(Sphere(1.0)),)), shape, points=8000)
    assert json.loads(json.dumps(ball.to_dict()))["edge_chamfer"] is None
