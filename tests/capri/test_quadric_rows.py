"""Rows of quadrics: values, first-order distances, and fits, against solids whose distance is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from partwright.capri import quadric_rows as rows
from partwright.fields import Quadric

POINTS = np.random.default_rng(0).uniform(-1, 1, (200, 3))
AXIS = np.array([2.0, -1.0, 2.0]) / 3


def test_values_are_those_of_the_field() -> None:
    row = np.random.default_rng(1).normal(size=10)
    np.testing.assert_allclose(
        rows.values(row, POINTS)[:, 0], Quadric(tuple(row)).polynomial(POINTS), atol=1e-12
    )
    np.testing.assert_allclose(rows.gradients(row, POINTS), Quadric(tuple(row)).gradient(POINTS), atol=1e-12)


@given(st.lists(st.floats(-5, 5), min_size=10, max_size=10))
def test_splitting_and_joining_are_inverses(values: list[float]) -> None:
    np.testing.assert_allclose(rows.joined(*rows.split(values)), values, atol=1e-12)


@pytest.mark.parametrize(
    ("row", "exact"),
    [
        (rows.plane(AXIS, 0.2), POINTS @ AXIS - 0.2),
        (rows.sphere((0.1, 0.2, 0), 0.7), np.linalg.norm(POINTS - (0.1, 0.2, 0), axis=1) - 0.7),
        (
            rows.cylinder((0.3, 0, 0), AXIS, 0.5),
            np.linalg.norm(np.cross(POINTS - (0.3, 0, 0), AXIS), axis=1) - 0.5,
        ),
    ],
    ids=["plane", "sphere", "cylinder"],
)
def test_distances_are_exact_near_the_surface(row: np.ndarray, exact: np.ndarray) -> None:
    np.testing.assert_array_equal(rows.values(row, POINTS)[:, 0] < 0, exact < 0)
    near = np.abs(exact) < 0.02
    assert near.sum() > 2
    np.testing.assert_allclose(rows.distances(row, POINTS)[near], exact[near], atol=1e-3)
    np.testing.assert_allclose(rows.values(row, POINTS)[near, 0], exact[near], atol=1e-3)


def test_a_cone_holds_the_points_within_its_angle() -> None:
    apex = np.array([0.1, 0.0, -0.2])
    rays = POINTS - apex
    angle = np.arccos(np.abs(rays @ AXIS) / np.linalg.norm(rays, axis=1))
    inside = rows.values(rows.cone(apex, AXIS, 0.6, 0.5), POINTS)[:, 0] < 0
    np.testing.assert_array_equal(inside, angle < 0.6)


def test_a_patch_of_an_ellipsoid_gives_the_ellipsoid() -> None:
    rng = np.random.default_rng(2)
    radii, centre = np.array([0.5, 0.8, 0.6]), np.array([0.1, -0.2, 0.3])
    unit = rng.normal(size=(200, 3))
    unit = np.abs(unit) / np.linalg.norm(unit, axis=1, keepdims=True)
    points, normals = unit * radii + centre, unit / radii
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for side in (1.0, -1.0):
        row = rows.fitted(points, side * normals)
        assert row is not None
        test = rng.uniform(-0.8, 0.8, (2000, 3))
        inside = (((test - centre) / radii) ** 2).sum(axis=1) < 1
        assert np.mean((rows.values(row, test)[:, 0] < 0) == inside) > 0.97


def test_a_flat_patch_is_no_curved_quadric() -> None:
    points = POINTS * (1, 1, 0)
    assert rows.fitted(points, np.tile([0.0, 0.0, 1.0], (len(points), 1))) is None
