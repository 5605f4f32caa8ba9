"""Outlines read off sections: lines, arcs and circles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection

from partwright.approximation.sketches.outlines import fitted_loop
from partwright.approximation.sketches.sections import profile_of
from partwright.approximation.sketches.tangents import with_tangents
from partwright.fields.profile import Profile, circle_of

TOLERANCE = 4e-4


def chords(profile: Profile, count: int) -> np.ndarray:
    """Corners (K, 2) of the outline with `count` chords an arc."""
    found = []
    for side in profile.sides[0]:
        if side.centre is None:
            found.append(side.start)
            continue
        x, y = np.subtract(side.start, side.centre)
        for angle in np.arange(count) * side.sweep / count:
            c, s = math.cos(angle), math.sin(angle)
            found.append((side.centre[0] + c * x - s * y, side.centre[1] + s * x + c * y))
    return np.array(found)


@pytest.mark.parametrize("count", [2, 3, 8, 20])
@pytest.mark.parametrize("shift", [0, 1, 5])
def test_a_rounded_rectangle_is_four_lines_and_four_arcs(count: int, shift: int) -> None:
    polygon = np.roll(chords(Profile.rectangle(1.0, 0.6, corner=0.15), count), shift, axis=0)
    loop = fitted_loop(polygon, TOLERANCE)
    assert loop is not None
    sides = Profile(loop).sides[0]
    assert sorted(side.centre is not None for side in sides) == [False] * 4 + [True] * 4
    assert [s.radius for s in sides if s.centre is not None] == pytest.approx([0.15] * 4, abs=1e-9)


@pytest.mark.parametrize("sides", [3, 4, 6, 8])
def test_a_regular_polygon_stays_one(sides: int) -> None:
    loop = fitted_loop(np.array(Profile.regular(sides, 0.5).outline)[:, :2], TOLERANCE)
    assert loop is not None
    assert len(loop) == sides
    assert not any(bulge for _, _, bulge in loop)


@pytest.mark.parametrize("count", [9, 12, 64])
def test_a_circle_is_one(count: int) -> None:
    loop = fitted_loop(np.array(Profile.regular(count, 0.5).outline)[:, :2] + (0.1, 0.2), TOLERANCE)
    assert loop is not None
    found = circle_of(loop)
    assert found is not None
    radius, centre = found
    assert (radius, *centre) == pytest.approx((0.5, 0.1, 0.2), abs=1e-9)


def test_corners_within_a_wall_are_no_corners() -> None:
    square = np.array([(0, 0), (0.3, 1e-6), (1, 0), (1, 0.5), (1, 1), (0, 1)])
    loop = fitted_loop(square, TOLERANCE)
    assert loop is not None
    assert len(loop) == 4


def test_walls_of_a_slot_are_lines_though_a_corner_of_the_mesh_lies_within_them() -> None:
    turns = np.linspace(-0.5, 0.5, 64) * math.pi
    half = np.column_stack([0.063 + 0.081 * np.cos(turns), 0.081 * np.sin(turns)])
    middle = np.array([[0.0, 0.081 + 5e-7]])  # as in single precision
    points = np.concatenate([half, middle, -half, -middle])
    loop = fitted_loop(points, TOLERANCE)
    assert loop is not None
    assert sorted(round(abs(bulge), 3) for _, _, bulge in loop) == [0.0, 0.0, 1.0, 1.0]


def test_an_arc_begins_where_the_line_is_tangent_to_it() -> None:
    """In vents of a lid, one chord of an end counted as part of the wall."""
    lean = math.radians(3)
    x, y = 0.02 * math.cos(lean), 0.2 + 0.02 * math.sin(lean)
    bulge = math.tan((math.pi - lean) / 4)
    off = Profile([(0.02, -0.2), (x, y, bulge), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    exact = with_tangents(off, TOLERANCE)
    assert exact.corners == pytest.approx(
        np.array([(0.02, -0.2, 0.0), (0.02, 0.2, 1.0), (-0.02, 0.2, 0.0), (-0.02, -0.2, 1.0)]), abs=1e-4
    )
    corner = Profile([(0.02, -0.2), (0.02, 0.2, 0.8), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    assert with_tangents(corner, TOLERANCE) is corner
    drawn = Profile([(0.02, -0.2), (0.02, 0.2, 1.0), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    assert with_tangents(drawn, TOLERANCE) is drawn


def test_what_is_flat_is_no_outline() -> None:
    assert fitted_loop(np.array([(0, 0), (1e-6, 0), (0, 1e-6)]), TOLERANCE) is None


def test_a_hole_that_touches_the_outline_is_a_hole() -> None:
    ring = CrossSection([[(0, 0), (1, 0), (1, 1), (0.5, 1), (0.8, 0.5), (0.2, 0.5), (0.5, 1), (0, 1)]])
    profile = profile_of(ring)
    assert profile is not None
    assert [len(loop) for loop in profile.loops] == [5, 3]
    assert profile.area == pytest.approx(1 - 0.15, abs=2e-3)
