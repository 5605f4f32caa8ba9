"""Exact members come back as they are; the rest as the solid that a person would name, with how far off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.approximation.nearest import nearest_solid
from partwright.assembly import Part
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    Solid,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)
from partwright.meshing import mesh_part

ENGINE: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)
length = st.floats(0.05, 5.0)
MEMBERS = st.one_of(
    st.builds(lambda x, y, z: Box((x, y, z)), length, length, length),
    st.builds(Cylinder, length, length),
    st.builds(Cone, length, length),
    st.builds(lambda r, t, h: Frustum(r, r * t, h), length, st.sampled_from([0.5, 0.8, 1.7]), length),
    st.builds(Sphere, length),
    st.builds(Capsule, length, length),
    st.builds(lambda r, t, h: Tube(r, r * t, h), length, st.floats(0.1, 0.9), length),
    st.builds(lambda r, t: Torus(r, r * t), length, st.floats(0.1, 0.9)),
)


@settings(max_examples=30)
@given(MEMBERS)
def test_exact_members_are_recognised(solid: Solid) -> None:
    part = Part(solid.superfrustum(), (1, 2, 3), (0.5, 0.5, 0.5, 0.5), blend=0.1, name="x")
    near = nearest_solid(part)
    assert near.exact
    assert near.max_deviation == 0
    assert type(near.solid) is type(solid)
    placed = near.part_with_solid
    assert (placed.translation, placed.rotation, placed.blend) == (part.translation, part.rotation, 0.1)
    points = np.random.default_rng(0).uniform(-6, 6, (500, 3))
    assert np.allclose(placed.distance(points), part.distance(points), atol=1e-4)


@pytest.mark.parametrize(
    ("field", "kind", "limit"),
    [
        (SuperFrustum((1, 2, 3), 0.1, 0.02), Box, 0.05),
        (SuperFrustum((1, 1, 3), 1.0, 0.05), Cylinder, 0.05),
        (SuperFrustum((1, 1, 3), 1.0, 0.0, 0.95), Cylinder, 0.06),
        (SuperFrustum((0.2, 0.2, 3), 1.0, 0.5), Capsule, 0.1),
        (SuperFrustum((0.1, 0.1, 0.1), 0.0, 1.0), Sphere, 0.1),
        (Frustum(1, 0.99, 3), Cylinder, 0.02),
    ],
)
def test_the_rest_becomes_what_a_person_would_name(field: Field, kind: type, limit: float) -> None:
    near = nearest_solid(Part(field, (5, 0, 0), (0.6, 0.8, 0, 0)), ENGINE[:4])
    assert type(near.solid) is kind
    assert 0 < near.volume_error_ratio < limit
    assert np.allclose(near.part_with_solid.translation, (5, 0, 0), atol=0.03)


def test_the_errors_are_those_that_sampling_finds() -> None:
    part = Part(Frustum(1.0, 0.5, 2.0), (3, 0, 0))
    near = nearest_solid(part, (Cylinder,))
    points = np.random.default_rng(1).uniform((1.5, -1.5, -1.5), (4.5, 1.5, 1.5), (200_000, 3))
    a, b = part.distance(points) < 0, near.part_with_solid.distance(points) < 0
    assert near.volume_error_ratio == pytest.approx((a ^ b).sum() / a.sum(), abs=0.03)
    there = np.abs(part.distance(mesh_part(near.part_with_solid).vertices)).max()
    back = np.abs(near.part_with_solid.distance(mesh_part(part).vertices)).max()
    assert near.max_deviation == pytest.approx(max(there, back), abs=1 / 24)


def test_an_axis_may_turn() -> None:
    rod = Part(SuperFrustum((3, 0.6, 0.6), 0.0, 0.2), name="rod")
    near = nearest_solid(rod, (Capsule,)).part_with_solid
    low, high = near.bounds()
    assert np.allclose(high - low, (3.4, 1.0, 1.0), atol=0.3)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_errors_scale_with_the_part(scale: float) -> None:
    part = Part(SuperFrustum((1, 2, 3), 0.4, 0.1, 0.7), (1, 1, 1))
    one, other = nearest_solid(part, ENGINE), nearest_solid(part.scaled(scale), ENGINE)
    assert type(one.solid) is type(other.solid)
    assert other.volume_error_ratio == pytest.approx(one.volume_error_ratio, rel=0.02)
    assert other.max_deviation == pytest.approx(one.max_deviation * scale, rel=0.02)


def test_the_same_every_time() -> None:
    part = Part(SuperFrustum((0.5, 0.7, 2), 0.4, 0.1, 0.7, 0.4, 0.2))
    assert nearest_solid(part, ENGINE).part_with_solid == nearest_solid(part, ENGINE).part_with_solid


def test_an_ellipsoid_is_found_for_a_dilated_disc() -> None:
    near = nearest_solid(Part(SuperFrustum((0.8, 0.8, 0.0), 1.0, 0.6)), (Sphere, Ellipsoid))
    assert isinstance(near.solid, Ellipsoid)
    assert near.solid.radii[2] < near.solid.radii[0]


def test_the_ellipsoid_is_a_distance() -> None:
    field = Ellipsoid((1.0, 2.0, 3.0))
    ends = np.array([[1, 0, 0], [0, -2, 0], [0, 0, 3], [1.01, 0, 0], [0, 0, 2.99]], np.float32)
    assert np.allclose(field(ends), [0, 0, 0, 0.01, -0.01], atol=2e-4)
    assert field(np.zeros((1, 3), np.float32))[0] < 0
    assert field.scaled(2.0).radii == (2, 4, 6)


def test_bad_input() -> None:
    with pytest.raises(NoSurfaceError, match="'sheet' has no volume"):
        nearest_solid(Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet"))
    with pytest.raises(NoSurfaceError, match="'point' has no volume"):
        nearest_solid(Part(SuperFrustum((0, 0, 0)), name="point"))
    with pytest.raises(ParameterError, match="torus"):
        nearest_solid(Part(Box((1, 1, 1))), (Torus,))
