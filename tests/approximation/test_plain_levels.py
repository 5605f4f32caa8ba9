"""Walls and axes that parts share stay one when their numbers become plain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from partwright.approximation.plain_levels import Levels
from partwright.approximation.plain_numbers import with_plain_numbers
from partwright.assembly import Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion
from partwright.fields.profile import Profile, circle

WITHIN = 1e-3
OVER = Similarity.turn((0, 1, 0), math.pi)


def plained(*parts: Part) -> list[Part]:
    levels = Levels.of(parts, WITHIN)
    return [with_plain_numbers(part, WITHIN, levels) for part in parts]


def ell(x: float, y: float) -> Extrusion:
    """A profile in the shape of an L, x by y wide."""
    return Extrusion(Profile([(-x, -y), (x, -y), (x, 0.3), (0.2, 0.3), (0.2, y), (-x, y)]), 2.0)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(0.5, 3), st.floats(0.5, 3))
def test_parts_side_by_side_stay_so(x: float, width: float, one: float, other: float) -> None:
    """A box, and a profile and another box right of it, wherever they are and however wide: one wall, and no
    number has moved by more than twice as much as is allowed."""
    left = Part(Box((one, 2.0, 2.0)), (x - one / 2, 0.4, 0.1))
    middle = Part(ell(other, 1.5), (x + other, width, 0.2))
    right = Part(Box((1.0, 1.0, 1.0)), (x + 2 * other + 0.5, 0.4, 0.2))
    made = plained(left, middle, right)
    ends = [part.bounds()[:, 0] for part in made]
    assert ends[0][1] == pytest.approx(ends[1][0], abs=1e-9)
    assert ends[1][1] == pytest.approx(ends[2][0], abs=1e-9)
    for part, was in zip(made, (left, middle, right), strict=True):
        assert np.abs(part.bounds() - was.bounds()).max() < 2.1 * WITHIN


def test_a_hole_and_a_shaft_in_it_have_one_axis() -> None:
    """One in a profile whose middle is at no plain place."""
    plate = Extrusion(Profile([(-3, -2), (3, -2), (3, 2), (-3, 2)], [circle(0.5, (1.00064, 0.5))]), 1.0)
    made, shaft = plained(Part(plate, (0.12345, 0.2, 0)), Part(Cylinder(0.4, 5.0), (1.12409, 0.7, 0)))
    assert isinstance(made.field, Extrusion)
    (hole,) = made.field.profile.holes
    centre = made.translation[0] + (hole[0][0] + hole[1][0]) / 2
    assert centre == pytest.approx(shaft.translation[0], abs=1e-12)
    assert hole[1][0] - hole[0][0] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("field", [Box((1.2345, 2.0, 1.0)), ell(0.61725, 1.5)])
def test_both_of_two_copies_are_where_others_have_their_walls(field: Box | Extrusion) -> None:
    half = 0.61725
    move = Similarity(OVER.scale, OVER.rotation, (0.50004, 0.0, 0.0))  # to the other side of the middle
    pair = Part(field, (1.11117, 0.3, 0.2), instances=(move,))
    places = [copy.translation[0] for copy in pair.copies]
    blocks = [Part(Box((1.0, 1.0, 1.0)), (place + half + 0.5, 5.0, 0.2)) for place in places]
    made, *others = plained(pair, *blocks)
    assert len(made.copies) == 2
    for copy, block in zip(made.copies, others, strict=True):
        assert copy.bounds()[1][0] == pytest.approx(block.bounds()[0][0], abs=1e-4)
    assert made.copies[0].bounds()[1][0] == pytest.approx(others[0].bounds()[0][0], abs=1e-12)


def test_what_no_other_part_has_is_as_plain_as_by_itself() -> None:
    part = Part(ell(1.00021, 1.5), (0.70007, 0.2, 0.1))
    assert plained(part, Part(Box((1, 1, 1)), (9, 9, 9)))[0] == with_plain_numbers(part, WITHIN)


def test_walls_that_lie_askew_are_nobodys() -> None:
    turn = Similarity.turn((0, 0, 1), 0.3).rotation
    part, block = Part(ell(1.0, 1.5), (0.0, 0.0, 0.0), turn), Part(Box((1, 1, 1)), (1.5004, 0, 0))
    assert plained(part, block)[0] == with_plain_numbers(part, WITHIN)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.3, 2), st.floats(0.3, 2))
def test_a_slanting_wall_that_two_parts_share_stays_one(
    x: float, y: float, width: float, height: float
) -> None:
    """Stacked extrusions, each with a middle of its own, whose slanting sides have the same ends."""
    ends = np.array([(x, y), (x + width, y + height)])

    def lying(back: float, z: float) -> Part:
        corners = np.array([*ends, (x - back, y + height + 0.5), (x - back, y - 0.1)])
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        return Part(Extrusion(Profile.polygon((corners - middle).tolist()), 1.0), (*middle.tolist(), z))

    parts = [lying(1.23456, 0.0), lying(2.71828, 1.0)]
    sides = []
    for part in plained(*parts):
        assert isinstance(part.field, Extrusion)
        corners = np.array(part.field.profile.outline)[:, :2] + part.translation[:2]
        sides.append([corners[np.abs(corners - end).sum(axis=1).argmin()] for end in ends])
        assert np.abs(np.array(sides[-1]) - ends).max() < 2.1 * WITHIN
    np.testing.assert_allclose(sides[0], sides[1], rtol=0, atol=1e-9)
