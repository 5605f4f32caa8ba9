"""Numbers read off a surface become what a person typed."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from partwright.approximation.plain import plain
from partwright.approximation.plain_numbers import with_plain_numbers
from partwright.assembly import Part, Similarity
from partwright.assembly.euler_angles import fixed_axes_angles
from partwright.assembly.instance_patterns import Circle, Grid, Ring, Row, pattern, with_pattern
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cone, Cylinder, Extrusion, Field, Revolution
from partwright.fields.profile import Profile, circle


@pytest.mark.parametrize(
    ("value", "within", "expected"),
    [
        (36.49998, 1e-3, 36.5),
        (-7.9996, 1e-3, -8.0),
        (12.7003, 1e-3, 12.7),
        (0.3333333, 1e-3, 0.333),
        (1e-5, 1e-3, 0.0),
        (-9e-4, 1e-3, 0.0),
        (0.0, 1e-3, 0.0),
        (1234.567, 0.0, 1234.567),
        (99.9, 0.2, 100.0),
    ],
)
def test_the_fewest_digits_win(value: float, within: float, expected: float) -> None:
    assert plain(value, within) == expected


def test_what_is_turned_loses_its_dust() -> None:
    """45 degrees but for a millionth are 45, which other angles stay; quarter turns go by plain lengths."""
    lug = Box((3.0, 1.0, 2.0))
    askew, odd = (Similarity.turn((1, 0, 0), math.radians(angle)).rotation for angle in (44.999999, 44.98))
    quarter = dataclasses.replace(about(90 - 4e-6), translation=(3.2000427, 1.0, 0.0))
    part = with_plain_numbers(Part(lug, (5.0, 0.0, 0.0), askew, instances=(quarter,)), 1e-3)
    turned = [fixed_axes_angles(rotation_matrix(copy.rotation)) for copy in part.copies]
    assert turned == [(45.0, 0.0, 0.0), (45.0, 0.0, 90.0)]
    assert part.instances[0].translation == (3.2, 1.0, 0.0)
    assert with_plain_numbers(Part(lug, rotation=odd), 1e-3).rotation == odd
    assert with_plain_numbers(part, 1e-3) == part


def test_lengths_corners_and_places_are_plain_and_turns_stay() -> None:
    turn = (math.cos(0.2), 0.0, 0.0, math.sin(0.2))
    outline = [(-10.0002, -5.0001, 0.0), (9.9999, -5, 0.4142), (10.0001, 5.0002, 0.0), (-10, 4.9998, 0.0)]
    plate = Extrusion(Profile(outline, (circle(2.00004, (1.0001, 0)),)), 3.0003)
    moves = (Similarity(translation=(20.0004, 0, 0)), Similarity(rotation=turn, translation=(0.123456, 0, 0)))
    part = with_plain_numbers(Part(plate, (0.99995, 2.00002, 0), turn, instances=moves), 1e-3)
    assert isinstance(part.field, Extrusion)
    assert [corner[:2] for corner in part.field.profile.outline] == [(-10, -5), (10, -5), (10, 5), (-10, 5)]
    assert part.field.profile.outline[1][2] == 0.4142
    assert part.field.height == 3.0
    assert (part.translation, part.rotation) == ((1.0, 2.0, 0.0), turn)
    assert part.instances[0] == Similarity(translation=(20, 0, 0))
    assert part.instances[1].rotation == pytest.approx(turn, abs=1e-12)
    place = moves[1](np.array([0.99995, 2.00002, 0]))
    there = np.array(part.copies[2].translation)
    assert there == pytest.approx(there.round(4), abs=1e-12), "a place of few digits"
    assert np.abs(there - place).max() < 1e-3
    assert with_plain_numbers(Part(Box((1.0001, 2, 3))), 1e-3).field == Box((1, 2, 3))


def about(degrees: float) -> Similarity:
    return Similarity.turn((0, 0, 1), math.radians(degrees))


def test_copies_of_what_is_round_are_shifts_to_plain_places() -> None:
    """At the corners of a rectangle, to which turns about its middle take the first of them."""
    sunk = Revolution(Profile([(0, -1), (2, -1), (4, 1), (0, 1)]))
    corner = math.degrees(math.atan2(8, 22))
    moves = tuple(about(angle + 3e-6) for angle in (180 - 2 * corner, 180, -2 * corner))
    for field in (sunk, Cylinder(2.0, 3.0)):
        plain_part = with_plain_numbers(Part(field, (22.0, 8.0, 1.0), instances=moves), 1e-3)
        assert all(move.rotation == (1.0, 0.0, 0.0, 0.0) for move in plain_part.instances)
        places = {copy.translation for copy in plain_part.copies}
        assert places == {(22, 8, 1), (-22, 8, 1), (-22, -8, 1), (22, -8, 1)}


def test_turns_that_mean_more_than_a_place_stay() -> None:
    ring = tuple(about(120 * k) for k in (1, 2))
    hole = Part(Cylinder(2.0, 3.0), (9.0, 0.0, 0.0), instances=ring)
    rib = dataclasses.replace(hole, field=Box((3.0, 1.0, 3.0)))
    assert pattern(with_plain_numbers(rib, 1e-3)) == Ring(3, "z", (0, 0, 0))
    square = dataclasses.replace(hole, field=Box((1.0, 2.0, 3.0)), instances=(about(40),))
    assert with_plain_numbers(square, 1e-3).instances == (about(40),)
    over = Similarity.turn((1, 0, 0), math.pi)  # a cone upside down
    cone = Part(Cone(2.0, 3.0), (9.0, 4.0, 0.0), instances=(over,))
    assert with_plain_numbers(cone, 1e-3).instances == (over,)


@pytest.mark.parametrize(
    ("field", "wanted"),
    [
        (Cylinder(2, 30), Circle(6, 34, 30, (3, 0, 5))),
        (Cylinder(2, 30), Grid((2, 3, 1), (40, 25.5, 0), (3, 0, 5))),
        (Box((2, 5, 3)), Grid((1, 9, 1), (0, 8, 0), (3, 0, 5))),
    ],
)
def test_copies_that_are_nearly_in_a_pattern_are_in_it(field: Field, wanted: Circle | Grid) -> None:
    """Places of which each was made plain by itself are on no circle any more: -14.72 and 14.725."""
    exact = with_pattern(Part(field), wanted)
    rng = np.random.default_rng(0)
    places = np.array([copy.translation for copy in exact.copies]) + rng.uniform(
        -6e-4, 6e-4, (len(exact.copies), 3)
    )
    rough = with_pattern(exact, Row(tuple(map(tuple, rng.permutation(places).tolist()))))
    assert isinstance(pattern(rough), Row)
    found = pattern(with_plain_numbers(rough, 1e-3))
    assert found == wanted


def test_boxes_turned_by_half_are_boxes_in_a_row() -> None:
    slots = Part(
        Box((2.0, 5.0, 3.0)), (9.0, 0.0, 0.0), instances=(about(180), Similarity(translation=(-9, 0, 0)))
    )
    assert pattern(with_plain_numbers(slots, 1e-3)) == Grid((3, 1, 1), (9, 0, 0), (0, 0, 0))


def test_parts_that_meet_go_on_meeting() -> None:
    """Places and heights that are plain each for themselves leave a slit of half a unit."""
    lower = with_plain_numbers(Part(Cylinder(1.0, 1.00004), (0, 0, 0.50002)), 1e-4)
    upper = with_plain_numbers(Part(Cylinder(1.0, 0.33333), (0, 0, 1.166705)), 1e-4)
    assert isinstance(lower.field, Cylinder)
    assert isinstance(upper.field, Cylinder)
    assert (
        upper.translation[2] - upper.field.height / 2 == lower.translation[2] + lower.field.height / 2 == 1.0
    )


def test_boxes_and_what_is_turned_meet_others_as_they_did() -> None:
    """A block beside one, and a ring on it: numbers made plain one by one leave slits at x = 1, z = 0.5."""
    one = with_plain_numbers(Part(Box((1.00008, 2, 1)), (0.49996, 0, 0)), 1e-4)
    other = with_plain_numbers(Part(Box((0.33333, 2, 1)), (1.166665, 0, 0)), 1e-4)
    ring = with_plain_numbers(
        Part(
            Revolution(Profile([(0.3, -0.13337), (0.6, -0.13337), (0.6, 0.2), (0.4, 0.3)])), (0, 0, 0.63337)
        ),
        1e-4,
    )
    assert one.bounds()[1][0] == other.bounds()[0][0] == 1.0
    assert ring.bounds()[0][2] == one.bounds()[1][2] == 0.5
    over = dataclasses.replace(ring, translation=(0, 0, 0.33332), rotation=(0.0, 1.0, 0.0, 0.0))
    assert with_plain_numbers(over, 1e-4).bounds()[1][2] == pytest.approx(0.4667, abs=1e-12)


def test_a_row_of_posts_stays_where_it_is() -> None:
    """Whichever of them is named first, and though they stand in a row along their own axis."""
    posts = Part(
        Revolution(Profile([(0, -1), (2, -1), (1, 1), (0, 1)])),
        (0, 0, 20.0003),
        instances=tuple(Similarity(translation=(0, 0, z)) for z in (-10, -20, 10.0001)),
    )
    found = with_plain_numbers(posts, 1e-3)
    assert {copy.translation for copy in found.copies} == {(0, 0, z) for z in (0, 10, 20, 30)}
    assert np.allclose([found.bounds()], [posts.bounds()], atol=2e-3)


def test_what_would_vanish_stays() -> None:
    thin = Part(Cylinder(1e-4, 5.0))
    assert with_plain_numbers(thin, 1e-3) == thin
