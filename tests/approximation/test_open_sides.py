"""Cuts and bosses go on where they end in the open, and sides of cuts where there is nothing behind them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from partwright.approximation.sketches.ends import BEYOND, typed_reach, with_open_ends
from partwright.approximation.sketches.open_sides import with_open_sides
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Revolution, Sphere, Tube
from partwright.fields.profile import Profile

HALF_TURN = Similarity(rotation=(0.0, 0.0, 0.0, 1.0))


def test_ends_in_the_open_go_on() -> None:
    plate = Part(Box((1.0, 1.0, 0.2)))
    through, blind = Part(Cylinder(0.1, 0.2)), Part(Cylinder(0.1, 0.1), (0, 0, 0.05))
    assert with_open_ends(through, False, plate.distance).field.height == pytest.approx(0.2 + 2 * BEYOND)
    longer = with_open_ends(blind, False, lambda p: np.maximum(plate.distance(p), -blind.distance(p)))
    assert longer.field.height == pytest.approx(0.1 + BEYOND)
    assert longer.translation[2] - longer.field.height / 2 == pytest.approx(0.0)
    boss = Part(Cylinder(0.2, 0.3), (0, 0, 0.25))
    stood = with_open_ends(boss, True, (plate | boss).distance)
    assert stood.translation[2] + stood.field.height / 2 == pytest.approx(0.4)
    assert stood.field.height == pytest.approx(0.3 + BEYOND)


def test_a_post_that_is_hollow_goes_on_in_the_floor_it_stands_on() -> None:
    post = Part(Tube(0.1, 0.03, 0.4), (0, 0, 0.2))

    def floor(points: np.ndarray) -> np.ndarray:
        return np.asarray(points[:, 2])

    longer = with_open_ends(post, True, floor)
    low, high = longer.bounds()
    assert (low[2], high[2]) == pytest.approx((-BEYOND, 0.4))


def test_open_sides_of_a_cut_move_out() -> None:
    plate = Part(Box((1.0, 1.0, 0.2)))
    notch = Part(Box((0.2, 0.4, 0.2)), (0.4, 0.0, 0.0))
    left = (plate - notch).distance
    wider = with_open_sides(notch, left)
    low, high = wider.bounds()
    assert low == pytest.approx([0.3, -0.2, -0.1])
    assert high == pytest.approx([0.5 + BEYOND, 0.2, 0.1])
    outline = [(0.3, -0.2), (0.5, -0.2), (0.5, 0.2), (0.3, 0.2, 1.0)]
    slot = Part(Extrusion(Profile(outline), 0.2))
    longer = with_open_sides(slot, (plate - slot).distance)
    assert isinstance(longer.field, Extrusion)
    assert longer.field.profile.area == pytest.approx(slot.field.profile.area + 0.4 * BEYOND)
    assert with_open_sides(Part(Box((0.2, 0.4, 0.2))), plate.distance) == Part(Box((0.2, 0.4, 0.2)))


def test_an_arc_of_a_cut_moves_out_where_it_lies_in_the_air() -> None:
    disc = Part(Cylinder(0.5, 0.2))
    reach = math.sqrt(0.25 - 0.16)
    bulge = math.tan(math.atan2(reach, 0.4) / 2)
    flat = Part(Extrusion(Profile([(0.4, -reach, bulge), (0.4, reach)]), 0.3), instances=(HALF_TURN,))
    cut = with_open_sides(flat, Assembly((disc, flat), "difference").distance)
    assert len(cut.copies) == 2
    low, high = cut.copies[0].bounds()
    assert low[0] == pytest.approx(0.4, abs=1e-9)  # the flat stays where it was
    assert high[0] == pytest.approx(0.5 + BEYOND, abs=1e-9)
    walled = Assembly((disc, Part(Box((0.02, 1.0, 0.2)), (0.51, 0.0, 0.0))))
    assert with_open_sides(flat, walled.distance) == flat


def test_an_open_side_beside_a_wall_that_goes_on_in_its_direction_moves_out_at_its_other_end() -> None:
    """Between the teeth of a helical gear: parallels of the two would meet beyond the wall's end."""
    outline = [(0.0, -0.4), (0.5, -0.4, 0.1), (0.5, -0.2), (0.5, 0.2), (0.52, 0.4), (0.0, 0.4)]
    cut = Part(Extrusion(Profile(outline), 0.2))
    plate, wall = Part(Box((1.0, 1.0, 0.2))), Part(Box((0.3, 0.4, 0.2)), (0.65, 0.4, 0.0))
    left = Assembly((Assembly((plate, cut), "difference"), wall))
    wider = with_open_sides(cut, left.distance)
    assert wider.bounds()[1][0] == pytest.approx(0.51 + BEYOND)
    points = np.random.default_rng(0).uniform((-0.1, -0.5, -0.1), (0.6, 0.5, 0.1), (20000, 3))
    more = points[(wider.distance(points) < 0) & (cut.distance(points) >= 0)]
    assert len(more) > 100
    assert left.distance(more).min() > -1e-3


def test_round_sides_of_a_turned_cut_move_out_where_they_lie_in_the_air() -> None:
    ball = Part(Sphere(0.5))
    rim = math.sqrt(0.25 - 0.04)  # where the ball is as high as the cut begins
    bulge = math.tan(math.atan2(rim, 0.2) / 4)
    cap = Part(Revolution(Profile([(0.0, 0.2), (rim, 0.2, bulge), (0.0, 0.5)])))
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (20000, 3))
    cut = with_open_sides(cap, ball.distance)
    assert isinstance(cut.field, Revolution)
    assert cut.field.bounds()[1][2] == pytest.approx(0.5 + BEYOND, abs=1e-6)  # nothing is left of the cap
    assert cut.field.bounds()[0][2] == pytest.approx(0.2, abs=1e-6)  # the floor stays where it was
    within = ball.distance(points) < 0
    left = within & (cut.distance(points) >= 0)
    assert (left == (within & (points[:, 2] < 0.2))).all()
    near, nearer = (
        Assembly((ball, Part(Box((2.0, 2.0, 0.1)), (0.0, 0.0, 0.55 + gap)))) for gap in (0.01, 0.003)
    )
    assert with_open_sides(cap, near.distance).bounds()[1][2] == pytest.approx(0.5 + BEYOND / 4)
    assert with_open_sides(cap, nearer.distance) == cap  # something is behind that side


def test_an_arc_that_meets_a_wall_moves_out_by_as_little_as_leaves_the_wall() -> None:
    """A knuckle of a hinge is cut out: moved any further, the barrel's arc would pass the plate's edge."""
    corner = -math.sqrt(0.12**2 - 0.03**2)
    turn = math.atan2(-0.03, corner) % (2 * math.pi)
    arc = math.tan((turn + math.pi / 2) / 4)
    barrel = [(0.0, -0.12, arc), (corner, -0.03), (-0.12, -0.03), (-0.12, -0.12)]
    gap = Part(Extrusion(Profile(barrel), 0.3))
    plate = Part(Box((0.4, 0.09, 1.0)), (-0.32, -0.075, 0.0))
    cut = with_open_sides(gap, plate.distance)
    assert 1e-3 < cut.bounds()[1][1] - 0.12 < BEYOND / 4
    edge = np.array([[-0.12, y, 0.0] for y in np.linspace(-0.115, -0.035, 9)])
    np.testing.assert_allclose(cut.distance(edge), 0.0, atol=2e-4)  # it stays where it was


@given(st.floats(1e-4, 1e4))
def test_open_ends_go_on_by_a_number_of_one_digit_in_the_shapes_own_units(scale: float) -> None:
    reach = typed_reach(scale)
    assert BEYOND / 2 < reach <= BEYOND * (1 + 1e-9)
    assert float(f"{reach / scale:.0e}") == pytest.approx(reach / scale, rel=1e-9)


def test_a_cut_through_a_plate_is_as_long_as_a_person_would_type() -> None:
    longest = 119.0  # mm, of which half is a unit length
    plate, through = Part(Box((1, 1, 5 * 2 / longest))), Part(Cylinder(0.1, 5 * 2 / longest))
    longer = with_open_ends(through, False, plate.distance, typed_reach(2 / longest))
    assert longer.field.height * longest / 2 == pytest.approx(5 + 2 * 1)
