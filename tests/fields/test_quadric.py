"""Quadrics against exact distances, their own algebra, and the names of their surfaces."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright import fields
from partwright.errors import ParameterError
from partwright.fields import Quadric, normal_form

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-2, 2, (2000, 3))
AXIS = np.array([2.0, -1.0, 2.0]) / 3
COEFFICIENTS = st.tuples(*[st.floats(-3, 3, allow_subnormal=False)] * 10).filter(
    lambda c: max(abs(v) for v in (*c[:6], *c[7:])) > 1e-2
)


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def about_axis(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(points, AXIS), axis=1)


def ellipsoid_points(radii: tuple[float, float, float], count: int) -> np.ndarray:
    sphere = RNG.normal(size=(count, 3))
    return sphere / np.linalg.norm(sphere, axis=1, keepdims=True) * radii


EXACT = [
    (Quadric.plane(3 * AXIS, 0.4), POINTS @ AXIS - 0.4),
    (Quadric.sphere(0.6, (0.1, 0.2, 0.3)), np.linalg.norm(POINTS - (0.1, 0.2, 0.3), axis=1) - 0.6),
    (Quadric.cylinder(0.3, AXIS), about_axis(POINTS) - 0.3),
    (Quadric.cylinder(0.3, AXIS, (0.5, 0, 0)).complement(), 0.3 - about_axis(POINTS - (0.5, 0, 0))),
]


@pytest.mark.parametrize(("quadric", "truth"), EXACT, ids=["plane", "sphere", "cylinder", "hole"])
def test_planes_spheres_and_cylinders_are_exact_everywhere(quadric: Quadric, truth: np.ndarray) -> None:
    assert quadric(POINTS).dtype == np.float32
    np.testing.assert_allclose(quadric(POINTS), truth, atol=5e-7)
    np.testing.assert_allclose(quadric(torch.tensor(POINTS)), truth, atol=1e-12)


@pytest.mark.parametrize("radii", [(0.2, 0.5, 1.0), (0.9, 0.9, 0.1)])
def test_an_ellipsoids_distance_is_a_lower_bound_and_first_order(radii: tuple[float, float, float]) -> None:
    from scipy.spatial import cKDTree

    quadric, surface = Quadric.ellipsoid(radii), ellipsoid_points(radii, 200_000)
    truth = cKDTree(surface).query(POINTS)[0]
    assert (np.abs(quadric(POINTS)) <= truth + 1e-6).all()
    normal = quadric.gradient(surface[:500])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for step in (-1e-4, 1e-4):
        np.testing.assert_allclose(quadric(surface[:500] + step * normal), step, rtol=0.02)


@given(COEFFICIENTS)
@settings(max_examples=60)
def test_the_distance_is_finite_has_the_polynomials_sign_and_agrees_in_torch(c: tuple[float, ...]) -> None:
    quadric = Quadric(c)
    value, distance = quadric.polynomial(POINTS), quadric(POINTS)
    assert np.isfinite(distance).all()
    clear = np.abs(value) > 1e-6
    assert (np.sign(distance[clear]) == np.sign(value[clear])).all()
    np.testing.assert_allclose(quadric(torch.tensor(POINTS)), distance, rtol=1e-5, atol=1e-6)


def test_the_gradient_in_torch_is_that_of_finite_differences() -> None:
    quadric = Quadric((1, 0.5, -0.3, 0.2, 0, 1, -0.4, 0.3, 0, 0.1))
    points = torch.tensor(POINTS[:50], requires_grad=True)
    assert torch.autograd.gradcheck(quadric, points, eps=1e-6, atol=1e-6)


@given(COEFFICIENTS, st.integers(0, 50), st.floats(0.1, 8))
@settings(max_examples=40)
def test_moving_and_scaling_take_the_field_along(c: tuple[float, ...], seed: int, factor: float) -> None:
    quadric, turn, shift = Quadric(c), rotation(seed), np.array([0.3, -0.8, 0.5])
    moved = quadric.moved(turn, shift)
    np.testing.assert_allclose(
        moved.polynomial(POINTS @ turn.T + shift), quadric.polynomial(POINTS), atol=1e-10
    )
    # What is a vanishing term here may be none there: compare where the bound does not hang on it.
    np.testing.assert_allclose(quadric.scaled(factor)(factor * POINTS), factor * quadric(POINTS), rtol=1e-3)
    assert fields.from_dict(json.loads(json.dumps(quadric.to_dict()))) == quadric


def test_seven_coefficients_are_ten_without_cross_terms() -> None:
    assert Quadric((1, 1, 1, 0, 0, 0, -1)) == Quadric((1, 1, 1, 0, 0, 0, -1, 0, 0, 0)) == Quadric.sphere(1)


@pytest.mark.parametrize(
    "bad",
    [
        (0,) * 10,
        (0, 0, 0, 0, 0, 0, 5),
        (1, 2, 3),
        (1, 0, 0, 0, 0, 0, float("nan")),
        (True,) * 7,
        ("x",) * 7,
        7,
    ],
)
def test_bad_coefficients_are_refused(bad: object) -> None:
    with pytest.raises(ParameterError, match="quadric"):
        Quadric(bad)  # type: ignore[arg-type]


def test_support_is_where_the_solid_ends() -> None:
    turn, shift = rotation(3), np.array([1.0, 2, 3])
    quadric = Quadric.ellipsoid((0.2, 0.5, 1.0)).moved(turn, shift)
    surface = ellipsoid_points((0.2, 0.5, 1.0), 200_000) @ turn.T + shift
    lower, upper = quadric.bounds()
    np.testing.assert_allclose(lower, surface.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(upper, surface.max(axis=0), atol=1e-4)
    bowl = Quadric((1, 2, 0, 0, 0, 1, -1))  # x^2 + 2 y^2 + z <= 1
    # At x = 3/8, z = 1 - 9/64: the farthest point along (0.6, 0, 0.8).
    reach = bowl.support(np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, 0, 0.8]]))
    np.testing.assert_allclose(reach, [1, np.inf, np.inf, 0.6 * 0.375 + 0.8 * (1 - 0.375**2)])
    assert (Quadric((1, 1, 1, 0, 0, 0, 1)).support(np.eye(3)) == -np.inf).all()


NAMED = [
    ("plane", Quadric.plane((1, 2, 3), 1)),
    ("sphere", Quadric.sphere(2)),
    ("ellipsoid", Quadric.ellipsoid((1, 2, 3))),
    ("cylinder", Quadric.cylinder(0.1)),
    ("elliptic cylinder", Quadric.ellipsoid((1, 2, np.inf))),
    ("cone", Quadric.cone(0.3)),
    ("elliptic cone", Quadric((1, 2, -1, 0, 0, 0, 0))),
    ("paraboloid", Quadric((1, 1, 0, 0, 0, -1, 0))),
    ("elliptic paraboloid", Quadric((1, 2, 0, 0, 0, -1, 0))),
    ("hyperbolic paraboloid", Quadric((1, -1, 0, 0, 0, 1, 0))),
    ("hyperboloid of one sheet", Quadric((1, 1, -1, 0, 0, 0, -1))),
    ("hyperboloid of two sheets", Quadric((1, 1, -1, 0, 0, 0, 1))),
    ("parabolic cylinder", Quadric((1, 0, 0, 0, 0, 1, 0))),
    ("hyperbolic cylinder", Quadric((1, -1, 0, 0, 0, 0, 1))),
    ("parallel planes", Quadric((1, 0, 0, 0, 0, 0, -1))),
    ("crossing planes", Quadric((1, -1, 0, 0, 0, 0, 0))),
    ("none", Quadric((1, 1, 1, 0, 0, 0, 1))),
]


@pytest.mark.parametrize(("name", "quadric"), NAMED, ids=[name for name, _ in NAMED])
@pytest.mark.parametrize("seed", range(3))
def test_surfaces_have_their_name_in_every_place(name: str, quadric: Quadric, seed: int) -> None:
    moved = quadric.moved(rotation(seed), np.array([0.4, -0.7, 0.2]))
    for solid in (moved, moved.complement()):
        form = normal_form(solid)
        assert form.name == name
        assert np.linalg.det(form.axes) == pytest.approx(1)
        ratio = np.array(form.quadric().coefficients) @ np.array(solid.coefficients)
        size = np.linalg.norm(form.quadric().coefficients) * np.linalg.norm(solid.coefficients)
        assert ratio / size == pytest.approx(1, abs=1e-9)


def test_the_normal_form_measures_a_cylinder() -> None:
    form = normal_form(Quadric.cylinder(0.25, AXIS, (1, 2, 3)))
    np.testing.assert_allclose(np.abs(form.axes[:, 2] @ AXIS), 1)
    np.testing.assert_allclose(form.radii, [0.25, 0.25, np.inf], rtol=1e-9)
    assert about_axis(form.centre[None] - (1, 2, 3))[0] < 1e-9
