"""Named solids against their exact signed distances, and the SuperFrustum's own properties."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright import fields
from partwright.errors import ParameterError
from partwright.fields import Box, Capsule, Cone, Cylinder, Field, Frustum, Sphere, SuperFrustum, Torus, Tube
from partwright.fields.columns import FIELD

POINTS = np.random.default_rng(0).uniform(-1.5, 1.5, (4000, 3))
X, Y, Z = POINTS.T
RHO = np.hypot(X, Y)

ALL: list[Field] = [
    SuperFrustum((0.5, 0.4, 0.9), 0.7, 0.02, 1.3, 0.4, 0.6),
    Box((0.7, 0.4, 1.1)),
    Cylinder(0.4, 0.9),
    Cone(0.5, 0.8),
    Frustum(0.3, 0.5, 0.8),
    Sphere(0.6),
    Capsule(0.2, 0.9),
    Tube(0.5, 0.1, 0.8),
    Torus(0.6, 0.2),
]


def box(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Distance to a rectangle from the two distances beyond its sides."""
    return np.hypot(np.maximum(u, 0), np.maximum(v, 0)) + np.minimum(np.maximum(u, v), 0)


def cone(bottom: float, top: float, height: float) -> np.ndarray:
    """Distance to a frustum: the base disc, the top disc, the slanted side; negative between them."""
    z = Z + height / 2
    disc = [np.hypot(np.maximum(RHO - r, 0), z - at) for r, at in ((bottom, 0), (top, height))]
    slant = math.hypot(bottom - top, height)
    along = np.clip(((bottom - RHO) * (bottom - top) + z * height) / slant**2, 0, 1)
    side = np.hypot(RHO - bottom + along * (bottom - top), z - along * height)
    inside = (z > 0) & (z < height) & (RHO - bottom < (top - bottom) * z / height)
    return np.where(inside, -1, 1) * np.minimum(np.minimum(*disc), side)


def cuboid(sx: float, sy: float, sz: float) -> np.ndarray:
    q = np.abs(POINTS) - np.array([sx, sy, sz]) / 2
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)


EXACT = [
    (Box((0.7, 0.4, 1.1)), cuboid(0.7, 0.4, 1.1)),
    (Cylinder(0.4, 0.9), box(RHO - 0.4, np.abs(Z) - 0.45)),
    (Cone(0.5, 0.8), cone(0.5, 0.0, 0.8)),
    (Frustum(0.5, 0.3, 0.8), cone(0.5, 0.3, 0.8)),
    (Frustum(0.3, 0.6, 0.8), cone(0.3, 0.6, 0.8)),
    (Sphere(0.6), np.linalg.norm(POINTS, axis=1) - 0.6),
    (Capsule(0.2, 0.9), np.hypot(RHO, np.maximum(np.abs(Z) - 0.45, 0)) - 0.2),
    (Tube(0.5, 0.1, 0.8), box(np.abs(RHO - 0.45) - 0.05, np.abs(Z) - 0.4)),
    (Torus(0.6, 0.2), np.hypot(RHO - 0.6, Z) - 0.2),
]


@pytest.mark.parametrize(("solid", "truth"), EXACT, ids=lambda value: getattr(value, "kind", ""))
def test_solids_are_exact_everywhere(solid: Field, truth: np.ndarray) -> None:
    by_kernel = solid(POINTS)
    assert by_kernel.dtype == np.float32
    np.testing.assert_allclose(by_kernel, truth, atol=1e-6)
    np.testing.assert_allclose(solid(torch.tensor(POINTS)), truth, atol=1e-9)


@pytest.mark.parametrize("solid", ALL, ids=lambda solid: solid.kind)
def test_scaling_and_files_keep_the_field(solid: Field) -> None:
    twice = solid.scaled(2.5)
    assert type(twice) is type(solid)
    np.testing.assert_allclose(twice(POINTS), 2.5 * solid(POINTS / 2.5), atol=3e-6)
    assert fields.from_dict(json.loads(json.dumps(solid.to_dict()))) == solid
    with pytest.raises(ParameterError, match="scale factor"):
        solid.scaled(0)


@settings(max_examples=80)
@given(st.integers(0, 2**32 - 1))
def test_bounds_hold_the_inside(seed: int) -> None:
    generator = np.random.default_rng(seed)
    size = generator.uniform(0, 1, 3)
    scalars = generator.uniform(0, 1, 5) * [1, 0.3, 2, 1, 1]
    field = SuperFrustum(tuple(size), *scalars)
    lower, upper = field.bounds()
    points = generator.uniform(1.5 * lower - 0.1, 1.5 * upper + 0.1, (4000, 3))
    inside = points[field(points) < 0]
    assert (inside >= lower - 1e-6).all()
    assert (inside <= upper + 1e-6).all()


@pytest.mark.parametrize(
    ("field", "lower", "upper"),
    [
        (SuperFrustum((0.6, 0.4, 1.0), 0.5, 0.1, 1.5), (-0.5, -0.4, -0.6), (0.5, 0.4, 0.6)),
        (SuperFrustum((0.2, 0.4, 1.0), bulge=1.0), (-0.6, -0.2, -0.6), (0.0, 0.2, 0.6)),
        (SuperFrustum((0.0, 0.0, 1.0), bulge=1.0, dilation=0.1), (-0.6, -0.1, -0.6), (0.1, 0.1, 0.6)),
    ],
)
def test_bounds_are_tight_where_the_extent_is_known(field: SuperFrustum, lower: Any, upper: Any) -> None:
    np.testing.assert_allclose(field.bounds(), (lower, upper), atol=1e-12)


def test_thinnest_is_the_wall_the_width_or_the_height() -> None:
    assert Tube(0.5, 0.05, 1.0).superfrustum().thinnest == pytest.approx(0.05)
    assert Cylinder(0.2, 1.0).superfrustum().thinnest == pytest.approx(0.4)
    assert Box((0.5, 0.4, 0.03)).superfrustum().thinnest == pytest.approx(0.03)
    assert Torus(0.6, 0.2).superfrustum().thinnest == pytest.approx(0.4)
    assert Sphere(0.3).superfrustum().thinnest == pytest.approx(0.6)
    assert not Cylinder(0.2, 1.0).superfrustum().hollow


def test_rows_and_parameters_round_trip() -> None:
    field = SuperFrustum((0.5, 0.25, 1.0), 0.5, 0.125, 1.5, 0.25, 0.75)
    row = field.row(translation=(1, 2, 3), rotation=(0, 1, 0, 0), blend=0.5)
    np.testing.assert_array_equal(
        row, np.float32([1, 2, 3, 0, 1, 0, 0, 0.5, 0.25, 1, 0.5, 0.125, 1.5, 0.25, 0.75, 0.5])
    )
    assert SuperFrustum.from_parameters(row[FIELD]) == field
    assert SuperFrustum.from_parameters(field.parameters()) == field


def test_torch_points_give_gradients() -> None:
    points = torch.tensor(POINTS[:50], requires_grad=True)
    (gradient,) = torch.autograd.grad(Sphere(0.6)(points).sum(), points)
    np.testing.assert_allclose(
        gradient, points.detach() / points.detach().norm(dim=1, keepdim=True), atol=1e-9
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("size", (1, 1)), ("size", "123"), ("size", None), ("size", (1, -1, 1)), ("size", (1, math.nan, 1)),
        ("size", [1, [2], 3]), ("size", {"x": 1}), ("roundness", 1.01), ("roundness", "0.5"),
        ("roundness", True), ("dilation", -1e-9), ("dilation", math.inf), ("dilation", 10**400),
        ("taper", 2.5), ("taper", None), ("bulge", -0.1), ("onion", math.nan),
    ],
)  # fmt: skip
def test_bad_parameters_are_named(name: str, value: Any) -> None:
    data = SuperFrustum((1, 1, 1)).to_dict() | {name: value}
    with pytest.raises(ParameterError, match=rf"superfrustum: {name} is .*expected"):
        fields.from_dict(data)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (None, "expected an object"),
        ([1, 2], "expected an object"),
        ({}, "kind is None"),
        ({"kind": ["box"]}, "expected one of"),
        ({"kind": "dodecahedron"}, "expected one of superfrustum, box"),
        ({"kind": "box"}, "missing parameters.*size"),
        ({"kind": "sphere", "radius": 1, "__class__": 3}, "unknown parameters.*__class__"),
        ({"kind": "sphere", "radius": 0}, "radius is 0; expected 0 < value"),
        ({"kind": "tube", "radius": 1, "thickness": 1, "height": 1}, "a tube without a hole is a cylinder"),
        ({"kind": "torus", "major_radius": 1, "minor_radius": 2}, "less than the major_radius"),
        ({"kind": "frustum", "bottom_radius": 1, "top_radius": 3, "height": 1}, "turn the part over"),
    ],
)
def test_hostile_data_is_refused(data: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        fields.from_dict(data)


# All that text can hold; Hypothesis takes seconds to find the same by its default, what UTF-8 can hold.
TEXT = st.text(st.characters(exclude_categories=["Cs"]))


@given(st.recursive(st.none() | st.booleans() | st.floats() | TEXT, st.lists, max_leaves=5))
def test_any_value_is_accepted_or_refused_by_name(value: Any) -> None:
    try:
        found = fields.from_dict({"kind": "cone", "radius": value, "height": 1})
    except ParameterError:
        return
    assert found == Cone(value, 1.0)
