"""Bounds and distances of assemblies whose leaves are quadrics, most of them without end."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Quadric

TURN = Similarity(1.0, (0.9, 0.1, -0.3, 0.2), (0.4, -1.0, 2.0))
CORNERS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)


def half_spaces(half: float = 1.0, noise: float = 0.0) -> Assembly:
    rng = np.random.default_rng(0)
    planes = [Quadric.plane(n, half).coefficients for n in np.vstack([np.eye(3), -np.eye(3)])]
    return Assembly(
        tuple(Part(Quadric(tuple(np.array(c) + noise * rng.normal(size=10)))) for c in planes), "intersection"
    )


@pytest.mark.parametrize("noise", [0.0, 1e-9])
def test_six_half_spaces_have_the_bounds_of_their_cube(noise: float) -> None:
    corners = TURN(CORNERS)
    expected = [corners.min(axis=0), corners.max(axis=0)]
    np.testing.assert_allclose(half_spaces(noise=noise).transformed(TURN).bounds(), expected, atol=1e-7)


def test_planes_bound_what_curved_quadrics_leave_open() -> None:
    slab = [Part(Quadric.plane((0, 0, 1), 2)), Part(Quadric.plane((0, 0, -1), 0))]
    for curved in (Quadric.cone(0.5), Quadric.cylinder(1.0), Quadric((1, 1, 0, 0, 0, -0.5, 0))):
        box = Assembly((Part(curved), *slab), "intersection").bounds()
        np.testing.assert_allclose(box, [[-1, -1, 0], [1, 1, 2]], atol=1e-6)


def test_bounds_hold_every_inside_point_of_random_intersections() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.2, 1.2, (20_000, 3))
    for _ in range(10):
        curved = [Part(Quadric(tuple(rng.normal(size=10)))) for _ in range(3)]
        tree = Assembly((half_spaces(), *curved), "intersection").transformed(TURN)
        inside = TURN(points)[tree.distance(TURN(points)) < 0]
        lower, upper = tree.bounds()
        assert ((inside >= lower - 1e-9) & (inside <= upper + 1e-9)).all()


def test_what_does_not_end_has_infinite_bounds_and_finite_distances() -> None:
    floor = Assembly((Part(Quadric.plane((0, 0, 1), 2)),))
    np.testing.assert_array_equal(floor.bounds(), [[-np.inf] * 3, [np.inf, np.inf, 2]])
    np.testing.assert_allclose(floor.distance(np.array([[5.0, 5, 7], [0, 0, 0]])), [5, -2])


def test_a_drilled_cube_of_quadrics_has_the_exact_distance_and_file(tmp_path: object) -> None:
    drill = Part(Quadric.cylinder(0.5))
    solid = (half_spaces() - drill).transformed(TURN)
    points = np.random.default_rng(0).uniform(-2, 2, (2000, 3))
    truth = np.maximum(np.abs(points).max(axis=1) - 1, 0.5 - np.hypot(points[:, 0], points[:, 1]))
    np.testing.assert_allclose(solid.distance(TURN(points)), truth, atol=1e-6)
    np.testing.assert_allclose(solid.distance(torch.tensor(TURN(points))), truth, atol=1e-9)
    np.testing.assert_allclose(solid.scaled(50).distance(50 * TURN(points)), 50 * truth, atol=1e-4)
    path = f"{tmp_path}/drilled.json"
    solid.save(path)
    assert pw.load_assembly(path) == solid


def test_copies_and_blends_count() -> None:
    ball = Part(Quadric.sphere(1.0), instances=(Similarity(translation=(5.0, 0, 0)),))
    np.testing.assert_allclose(Assembly((ball,)).bounds(), [[-1, -1, -1], [6, 1, 1]], atol=1e-6)
    joined = Assembly((Part(Box((2, 2, 2))), Part(Quadric.sphere(1.0), (0.5, 0, 0), blend=0.4)))
    lower, upper = joined.bounds()
    assert (lower <= -1.0).all()
    assert upper[0] >= 1.5
    points = np.random.default_rng(0).uniform(-3, 3, (20_000, 3))
    inside = points[joined.distance(points) < 0]
    assert ((inside >= lower) & (inside <= upper)).all()


@pytest.mark.parametrize("turned", [1.0, 0.0])
def test_what_holds_everything_takes_nothing_away(turned: float) -> None:
    """-x^2 - y^2 - z^2 - 1 <= 0 has no surface, and its gradient is 0 in the midst of the cube."""
    everything = Part(Quadric((-1, -1, -turned, 0, 0, 0, -1, 0, 0, 0)))
    cube = Assembly((Part(Box((1, 1, 1))), everything), "intersection")
    np.testing.assert_allclose(cube.bounds(), [[-0.5] * 3, [0.5] * 3], atol=1e-9)
    nothing = Part(Quadric((1, 1, turned, 0, 0, 0, 1, 0, 0, 0)))
    empty = Assembly((Part(Box((1, 1, 1))), nothing), "intersection").bounds()
    np.testing.assert_array_equal(empty[0], empty[1])
