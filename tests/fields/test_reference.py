"""The PyTorch reference against independent formulas, and the laws that a signed distance obeys."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from partwright.fields import reference

LOW = torch.zeros(8, dtype=torch.float64)
HIGH = torch.tensor([1.8, 1.8, 1.8, 1, 0.5, 2, 1, 1], dtype=torch.float64)
BULGE, ONION, DILATION = 6, 7, 4

seeds = st.integers(0, 2**32 - 1)


def random_parameters(generator: np.random.Generator, count: int) -> torch.Tensor:
    """(count, 8): size, roundness, dilation, taper, bulge, onion over their full ranges."""
    return LOW + torch.tensor(generator.uniform(0, 1, (count, 8))) * (HIGH - LOW)


def random_points(generator: np.random.Generator, count: int) -> torch.Tensor:
    return torch.tensor(generator.uniform(-1.5, 1.5, (count, 3)))


def distance(parameters: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    return reference.superfrustum(points, parameters[..., :3], *parameters[..., 3:].unbind(-1))


def polygon_distance(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Signed distance to a polygon by its segments and the crossing number."""
    squares, crossings = [], np.zeros(len(points), int)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = b - a
        u = np.clip((points - a) @ edge / max(edge @ edge, 1e-300), 0, 1)
        squares.append(((points - a - u[:, None] * edge) ** 2).sum(1))
        spans = (a[1] > points[:, 1]) != (b[1] > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings += spans & (points[:, 0] < a[0] + (points[:, 1] - a[1]) * edge[0] / edge[1])
    return np.where(crossings % 2 == 1, -1, 1) * np.sqrt(np.min(squares, axis=0))


@settings(max_examples=60)
@given(seeds)
def test_profile_is_the_distance_to_the_quad(seed: int) -> None:
    generator = np.random.default_rng(seed)
    m, h, dilation = generator.uniform(0.05, 1, 3) * [1, 1, 0.5]
    taper, onion = generator.uniform(0, 2), generator.choice([0.0, generator.uniform(0, 1)])
    top = (taper - 1) * m
    # A closed hole reaches the axis; the polygon then goes on far beyond it.
    closed = max(1, taper) * m * onion <= dilation
    inner_top, inner_bottom = (-9.0, -9.0) if closed else (-m + taper * m * onion, -m * (1 - onion))
    corners = np.array([(0, -h), (top, h), (inner_top, h), (inner_bottom, -h)])
    plane = generator.uniform([-m, -1.5], [1.5, 1.5], (300, 2))
    arguments = (
        torch.tensor(float(value), dtype=torch.float64).expand(300)
        for value in (m, h, dilation, taper, onion)
    )
    found = reference.profile(torch.tensor(plane[:, 0]), torch.tensor(plane[:, 1]), *arguments)
    np.testing.assert_allclose(found, polygon_distance(plane, corners), atol=1e-9)


@settings(max_examples=60)
@given(seeds)
def test_bend_follows_the_arc(seed: int) -> None:
    generator = np.random.default_rng(seed)
    h, theta = generator.uniform(0.05, 0.9), generator.uniform(0.05, math.pi / 2)
    x, _, z = random_points(generator, 300).numpy().T
    centre = h / math.tan(theta)
    phi = np.arctan2(z, centre - x)
    s, k, sign = math.sin(theta), math.cos(theta), np.where(z < 0, -1, 1)
    beyond = np.abs(phi) > theta
    ux, uz = x, np.abs(z) - h
    across = np.where(beyond, -ux * k + uz * s, np.hypot(x - centre, z) - math.hypot(centre, h))
    along = np.where(beyond, sign * (h + ux * s + uz * k), phi / theta * h)
    arguments = (torch.tensor(value, dtype=torch.float64) for value in (x, z, h, theta * 2 / math.pi))
    found = reference.bend(*arguments)
    np.testing.assert_allclose(found[0], across, atol=1e-9)
    np.testing.assert_allclose(found[1], along, atol=1e-9)


def test_half_ring_is_exact() -> None:
    """bulge = 1 and no cross-section: half a torus around y."""
    points = random_points(np.random.default_rng(0), 2000)
    points = points[points[:, 0] < 0]
    ring = torch.tensor([0, 0, 1.4, 0, 0.1, 1, 1, 0], dtype=torch.float64)
    x, y, z = points.T
    truth = torch.hypot(torch.hypot(x, z) - 0.7, y) - 0.1
    np.testing.assert_allclose(distance(ring, points), truth, atol=1e-9)


@settings(max_examples=40)
@given(seeds)
def test_pose_moves_the_field_rigidly(seed: int) -> None:
    generator = np.random.default_rng(seed)
    rotation, shift = Rotation.random(rng=generator), generator.uniform(-1, 1, 3)
    parameters, local = random_parameters(generator, 1), random_points(generator, 50)
    world = torch.tensor(rotation.apply(local.numpy()) + shift)
    pose = torch.tensor(np.hstack([shift, 3 * rotation.as_quat(scalar_first=True)]))[None]
    row = torch.cat([pose, parameters, torch.zeros(1, 1)], 1)
    posed, own = reference.evaluate(row, world), distance(parameters[0], local)
    # atan2 turns fast at the centre of an arc, where rounding of the pose shows.
    assert (posed - own).abs().median() < 1e-13
    assert ((posed - own).abs() < 1e-9).double().mean() > 0.95


@settings(max_examples=40)
@given(seeds, st.floats(1e-3, 1e3))
def test_scaling_law(seed: int, factor: float) -> None:
    generator = np.random.default_rng(seed)
    parameters, points = random_parameters(generator, 1)[0], random_points(generator, 50)
    lengths = torch.tensor([factor] * 3 + [1, factor, 1, 1, 1])
    expected = factor * distance(parameters, points)
    found = distance(parameters * lengths, factor * points)
    np.testing.assert_allclose(found, expected, atol=1e-6 * factor)


@settings(max_examples=60)
@given(seeds)
def test_straight_fields_are_one_lipschitz(seed: int) -> None:
    generator = np.random.default_rng(seed)
    parameters = random_parameters(generator, 1)[0]
    parameters[BULGE] = 0
    first = random_points(generator, 400)
    second = first + torch.tensor(
        generator.normal(size=(400, 3)) * generator.choice([1e-3, 0.1, 1], (400, 1))
    )
    change = (distance(parameters, first) - distance(parameters, second)).abs()
    assert (change <= (first - second).norm(dim=1) + 1e-10).all()


@settings(max_examples=40)
@given(seeds)
def test_a_vanishing_bulge_is_no_bulge(seed: int) -> None:
    generator = np.random.default_rng(seed)
    parameters, points = random_parameters(generator, 1)[0], random_points(generator, 100)
    parameters[2] = parameters[2] + 0.1  # the shorter the chord, the more the same bulge curves
    parameters[BULGE] = 0
    bent = parameters.clone()
    bent[BULGE] = 1e-7
    np.testing.assert_allclose(distance(bent, points), distance(parameters, points), atol=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_straight_axis_feels_which_way_to_bend(dtype: torch.dtype) -> None:
    points = torch.tensor([[0.4, 0.1, 0.2], [-0.3, 0.0, 0.7], [0.2, 0.5, -0.9]], dtype=dtype)
    for value in (0.0, 1e-6, 1e-4):
        parameters = torch.tensor(
            [0.3, 0.4, 1.0, 0.5, 0.01, 0.7, value, 0.2], dtype=dtype, requires_grad=True
        )
        (gradient,) = torch.autograd.grad(distance(parameters, points).sum(), parameters)
        step = torch.zeros(8, dtype=torch.float64)
        step[BULGE] = 1e-6
        at = parameters.detach().double()
        numeric = (distance(at + step, points.double()) - distance(at, points.double())).sum() / 1e-6
        assert gradient[BULGE] == pytest.approx(float(numeric), rel=1e-4)
        assert abs(numeric) > 0.1


@settings(max_examples=40)
@given(seeds, st.floats(0, 0.4))
def test_dilation_is_an_offset(seed: int, more: float) -> None:
    generator = np.random.default_rng(seed)
    parameters, points = random_parameters(generator, 1)[0], random_points(generator, 100)
    grown = parameters.clone()
    grown[DILATION] += more
    before, after = distance(parameters, points), distance(grown, points)
    hole = max(1.0, float(parameters[5])) * float(parameters[:2].min()) / 2 * float(parameters[ONION])
    if parameters[DILATION] < hole <= grown[DILATION]:  # the hole closes on the way
        assert (after <= before - more + 1e-12).all()
    else:
        np.testing.assert_allclose(after, before - more, atol=1e-12)


@settings(max_examples=200)
@given(seeds, st.sampled_from([torch.float32, torch.float64]))
def test_finite_at_the_ends_of_all_ranges(seed: int, dtype: torch.dtype) -> None:
    """Values and every gradient at centre, axis, corners, ends and arc centre of degenerate primitives."""
    generator = np.random.default_rng(seed)
    lengths, fractions = [0, 1e-8, 1e-3, 0.5, 1.8], [0, 1e-7, 0.5, 1 - 1e-6, 1]
    ends = [
        *[lengths] * 3,
        fractions,
        [0, 1e-6, 0.3],
        [0, 1e-7, 0.5, 1, 2],
        [0, 1e-12, 1e-4, 0.5, 1],
        fractions,
    ]
    parameters = torch.tensor(np.array([generator.choice(values) for values in ends]), dtype=dtype)
    sx, sy, sz, r, *_, b, _ = parameters.tolist()
    h, theta, corner = sz / 2, b * math.pi / 2, min(sx, sy) / 2 * r
    centre = h / math.tan(theta) if theta > 0 else 0.0
    special = [
        (0, 0, 0), (0, 0, h), (0, 0, -h), (0, sy / 2, 0), (1, 0, 0), (-1, -1, -1),
        (centre, 0, 0), (centre, sy / 2, 0), (centre, 0, h), (centre + 0.1, 0, 0), (centre + 1e-7, 0, 1e-7),
        (sx / 2, sy / 2, h), (-sx / 2, sy / 2, -h), (sx / 2 - corner, sy / 2 - corner, 0),
    ]  # fmt: skip
    pose = torch.tensor([0, 0, 0, 1, 0, 0, 0], dtype=dtype)
    blend = torch.tensor([generator.choice([0, 1e-9, 1e-5, 0.1, 1])], dtype=dtype)
    row = torch.cat([pose, parameters, blend])
    rows = torch.stack([row, row]).requires_grad_()  # two equal parts: the fold ties everywhere
    points = torch.tensor(special, dtype=dtype, requires_grad=True)
    found = reference.evaluate(rows, points)
    assert found.isfinite().all()
    for gradient in torch.autograd.grad(found.sum(), [rows, points]):
        assert gradient.isfinite().all()


def test_gradcheck_over_pose_shape_and_points() -> None:
    generator = np.random.default_rng(3)
    pose = torch.tensor(generator.uniform(-0.4, 0.4, (3, 7)))
    shape = LOW + (0.15 + 0.7 * torch.tensor(generator.uniform(0, 1, (3, 8)))) * (HIGH - LOW)
    rows = torch.cat([pose, shape, torch.full((3, 1), 0.3)], 1).requires_grad_()
    points = random_points(generator, 12).requires_grad_()
    assert torch.autograd.gradcheck(reference.evaluate, (rows, points), eps=1e-6, atol=1e-6)


def test_batches_equal_single_evaluations() -> None:
    generator = np.random.default_rng(0)
    parameters, points = random_parameters(generator, 6).reshape(2, 3, 8), random_points(generator, 10)
    batch = distance(parameters, points)
    assert batch.shape == (2, 3, 10)
    for i, j in np.ndindex(2, 3):
        assert torch.equal(batch[i, j], distance(parameters[i, j], points))


def test_float32_agrees_with_float64() -> None:
    generator = np.random.default_rng(0)
    parameters, points = random_parameters(generator, 100).float(), random_points(generator, 200).float()
    single, double = distance(parameters, points), distance(parameters.double(), points.double())
    assert single.dtype == torch.float32
    assert (single - double).abs().quantile(0.999) < 3e-6
