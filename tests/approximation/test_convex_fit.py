"""Native solids for convex ones: exact where there is an exact one, and around or within where asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold

from partwright.approximation.convex_fit import convex_fits, support, volume
from partwright.approximation.ellipsoid import Ellipsoid
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere

KINDS = (Box, Cylinder, Sphere, Capsule, Ellipsoid)
TURN = (30.0, 40.0, 50.0)
BALL = Manifold.sphere(1.0, 96)
CAPS = [BALL.scale((0.5,) * 3).translate((0, 0, z)) for z in (-1.0, 1.0)]
EXACT: dict[Field, Manifold] = {
    Box((1.0, 2.0, 3.0)): Manifold.cube((1, 2, 3), True),
    Cylinder(0.5, 2.0): Manifold.cylinder(2, 0.5, circular_segments=96, center=True),
    Sphere(1.0): BALL,
    Capsule(0.5, 2.0): Manifold.batch_hull(CAPS),
    Ellipsoid((1.0, 2.0, 3.0)): BALL.scale((1, 2, 3)),
}


@pytest.mark.parametrize("field", EXACT, ids=lambda field: field.kind)
@pytest.mark.parametrize("mode", ["nearest", "around", "within"])
def test_the_solid_that_it_is_wins(field: Field, mode: str) -> None:
    hull = EXACT[field].rotate(TURN).translate((5, 6, 7))
    best = convex_fits(hull, KINDS, mode)[0]  # type: ignore[arg-type]
    assert best.volume_error_ratio < 0.02
    assert best.deviation < 0.03
    if mode == "nearest" or isinstance(field, Box):  # a ball is an ellipsoid, too
        assert best.part.field.kind == field.kind
    assert volume(best.part.field) == pytest.approx(volume(field), rel=0.03)
    assert np.allclose(best.part.translation, (5, 6, 7), atol=0.01)


@pytest.mark.parametrize("mode", ["nearest", "around", "within"])
def test_what_is_off_by_more_than_asked_for_is_left_out(mode: str) -> None:
    hull = Manifold.cylinder(2, 0.5, circular_segments=96, center=True).rotate(TURN)
    every = convex_fits(hull, KINDS, mode)  # type: ignore[arg-type]
    for limits in ({"deviation": 0.2}, {"error": 0.2}):
        ((name, most),) = limits.items()
        known = {"deviation": lambda fit: fit.deviation, "error": lambda fit: fit.volume_error_ratio}[name]
        near = convex_fits(hull, KINDS, mode, **limits)  # type: ignore[arg-type]
        assert near[0] == every[0]
        assert all(known(fit) <= most for fit in near)
        assert len(near) < len(every)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(KINDS))
def test_around_contains_and_within_is_contained(seed: int, kind: type[Field]) -> None:
    points = np.random.default_rng(seed).normal(size=(20, 3)) * (1.0, 0.5, 0.2)
    hull = Manifold.hull_points(points)
    (around,) = convex_fits(hull, (kind,), "around")
    assert around.part.distance(points).max() <= 1e-6
    for inner in convex_fits(hull, (kind,), "within"):
        directions = np.random.default_rng(0).normal(size=(500, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        assert volume(inner.part.field) < hull.volume()
        assert hull.volume() < volume(around.part.field)
        own = support(inner.part.field, directions) - directions @ -np.zeros(3)
        assert own.min() > 0


@pytest.mark.parametrize("field", EXACT, ids=lambda field: field.kind)
def test_supports_and_volumes_are_those_of_the_solid(field: Field) -> None:
    mesh = EXACT[field].to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3]
    directions = np.random.default_rng(0).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.allclose(support(field, directions), (directions @ corners.T).max(axis=1), rtol=5e-3)
    assert volume(field) == pytest.approx(EXACT[field].volume(), rel=5e-3)
