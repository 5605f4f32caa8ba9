"""Profiles of lines and arcs: their area, reach and distance, and what they refuse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch

from partwright.errors import ParameterError
from partwright.fields import Profile, profile_crossings
from partwright.fields.profile import circle, circle_of
from partwright.fields.profile_distance import profile_distance, profile_gradients, reference
from partwright.fields.profile_offset import offset

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-1.9, 1.6, (2000, 2))
# Lines, arcs to both sides, more than half a circle, a round hole and one with a corner.
PLATE = Profile(
    [(-1, -0.6), (1, -0.6, 0.5), (1, 0.4), (0.2, 0.4, -0.4), (-0.5, 0.4, 0.3), (-1, 0.2, 1.7)],
    [circle(0.2), [(0.5, -0.3), (0.9, -0.3), (0.9, -0.1, 0.2)]],
)
EVERY = np.ones(len(PLATE.corners), dtype=bool)


def dense(profile: Profile) -> np.ndarray:
    """Points (K, 2) of all sides, 1e-3 apart."""
    loops = []
    for line in profile.polylines(1e-7):
        for a, b in zip(line, np.roll(line, -1, axis=0), strict=True):
            count = max(2, int(np.linalg.norm(b - a) / 1e-3))
            loops.append(a + np.linspace(0, 1, count)[:, None] * (b - a))
    return np.concatenate(loops)


def test_the_distance_is_exact_and_its_sign_is_right() -> None:
    from scipy.spatial import cKDTree

    found = profile_distance(PLATE, POINTS)
    np.testing.assert_allclose(np.abs(found), cKDTree(dense(PLATE)).query(POINTS)[0], atol=6e-4)
    ends = [(line, np.roll(line, -1, axis=0)) for line in PLATE.polylines(1e-7)]
    off = [((a - POINTS[:, None]), (b - POINTS[:, None])) for a, b in ends]
    turns = [
        np.arctan2(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0], (u * v).sum(-1)).sum(1) for u, v in off
    ]
    winding = np.round(sum(turns) / (2 * math.pi))
    near = np.abs(found) < 1e-5
    assert ((winding > 0) == (found < 0))[~near].all()


def test_the_kernel_is_the_reference_and_so_are_its_derivatives() -> None:
    found = profile_distance(PLATE, POINTS)
    corners = torch.tensor(PLATE.corners, requires_grad=True)
    places = torch.tensor(POINTS, requires_grad=True)
    slow = reference(corners, PLATE.starts, places, EVERY)
    np.testing.assert_allclose(found, slow.detach(), atol=1e-12)
    np.testing.assert_allclose(found, reference(PLATE.corners, PLATE.starts, POINTS, EVERY), atol=1e-12)
    weights = RNG.normal(size=len(POINTS))
    (slow * torch.tensor(weights)).sum().backward()
    by_corner, by_point = profile_gradients(PLATE, POINTS, weights)
    lines = PLATE.corners[:, 2] == 0  # the reference asks a line for no bulge
    expected = corners.grad.numpy()
    np.testing.assert_allclose(by_corner[:, :2], expected[:, :2], atol=1e-9)
    np.testing.assert_allclose(by_corner[~lines, 2], expected[~lines, 2], atol=1e-9)
    np.testing.assert_allclose(by_point * weights[:, None], places.grad, atol=1e-9)


def test_points_level_with_corners_and_on_symmetry_axes_are_told_apart() -> None:
    """Where a ray meets a corner, or the top of an arc, it meets the outline once, twice or not at all."""
    disc, gear = Profile.circle(1.0), Profile.regular(8, 1.0)
    for profile in (disc, gear):
        xs = np.linspace(-1.5, 1.5, 61)
        for y in (0.0, math.sqrt(0.5), -math.sqrt(0.5), 1.0, -1.0):
            inside = profile_distance(profile, np.column_stack([xs, np.full(61, y)])) < -1e-9
            half = (1 - abs(y)) / (1 - math.sqrt(0.5)) * math.sqrt(0.5) if abs(y) > 0.5 else 1.0
            wide = math.sqrt(1 - y * y) if profile is disc else half
            assert (inside == (np.abs(xs) < wide - 1e-6)).all()


def test_area_and_reach() -> None:
    assert Profile.circle(2.0, (5, 1)).area == pytest.approx(4 * math.pi)
    assert Profile.rectangle(4, 2, 0.5).area == pytest.approx(8 - (4 - math.pi) / 4)
    ring = Profile(circle(3), (circle(1),))
    assert ring.area == pytest.approx(8 * math.pi)
    lower, upper = PLATE.bounds()
    points = dense(PLATE)
    np.testing.assert_allclose([lower, upper], [points.min(0), points.max(0)], atol=1e-5)
    directions = RNG.normal(size=(50, 2))
    np.testing.assert_allclose(PLATE.support(directions), (directions @ points.T).max(1), atol=1e-4)


def test_the_solid_lies_on_the_left_of_every_side_whichever_way_it_was_drawn() -> None:
    backwards = [
        (*PLATE.outline[i][:2], -PLATE.outline[i - 1][2]) for i in range(len(PLATE.outline) - 1, -1, -1)
    ]
    again = Profile(backwards, [circle(0.2)])
    assert again.area == pytest.approx(Profile(PLATE.outline, [circle(0.2)]).area)
    assert Profile.from_dict(again.to_dict()) == again
    assert circle_of(again.holes[0]) == (pytest.approx(0.2), pytest.approx((0, 0)))
    assert circle_of(again.outline) is None


@pytest.mark.parametrize(
    ("outline", "holes", "message"),
    [
        ([(0, 0), (1, 1)], [], "no area"),
        ([(0, 0), (1, 0), (0, 1), (1, 1)], [], "no area"),
        ([(0, 0), (2, 0), (0, 1), (1, 1)], [], "sides cross"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], [], "same point"),
        ([(0, 0), (1, 0), (0, math.nan)], [], "expected"),
        ([(0, 0), (1, 0, 1e9), (0, 1)], [], "bulge"),
        ([(0, 0)], [], "two corners"),
        ("circle", [], "two corners"),
        ([(0, 0), (1, 0), (0, 1)], [circle(0.1, (3, 3))], "outside of the outline"),
        ([(-2, -2), (2, -2), (0, 2)], [circle(0.5), circle(0.2)], "within another hole"),
        ([(-2, -2), (2, -2), (0, 2)], [circle(2)], "sides cross"),
        ([(-2, -2), (2, -2), (0, 2)], 7, "list of closed loops"),
    ],
)
def test_what_is_no_profile_is_refused(outline: Any, holes: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Profile(outline, holes)


def test_the_parallel_curve_has_the_right_area() -> None:
    """Steiner's formula, of a polygon with one corner that points inwards: that becomes an arc."""
    corner = Profile.polygon([(-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)])
    inner, walls = offset(corner, 0.1)
    square = 5 * math.tan(math.pi / 4) - math.pi / 4
    assert inner.area == pytest.approx(corner.area - 0.1 * 8 + 0.01 * square)
    assert sum(wall.below is None for wall in walls[0]) == 1
    np.testing.assert_allclose(profile_distance(corner, inner.corners[:, :2]), -0.1, atol=1e-12)
    with pytest.raises(ParameterError, match="not every side"):
        offset(corner, 0.6)
    with pytest.raises(ParameterError, match="arc meets a side at a corner"):
        offset(Profile([(0, 0), (1, 0), (1, 1, 0.3), (0, 1)]), 0.1)


@pytest.mark.parametrize("pairs", [1, 200, 1 << 18])
def test_crossings_are_found_however_many_pairs_are_looked_at_at_once(
    pairs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(profile_crossings, "_PAIRS", pairs)
    turns = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    assert profile_crossings.first_crossing([ring, 0.5 * ring]) is None
    assert (
        profile_crossings.first_crossing([ring, ring + np.array([2.0, 0.0])]) is None
    )  # they touch at a corner
    apart = profile_crossings.first_crossing([ring, 0.5 * ring, ring + np.array([1.0, 0.0])])
    assert apart is not None
    np.testing.assert_allclose(apart, [0.5, math.sqrt(0.75)], atol=2e-3)
