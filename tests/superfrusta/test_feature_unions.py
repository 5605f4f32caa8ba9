"""Extrusions side by side become one of their common outline; what has none stays."""

from __future__ import annotations

import pytest

from partwright.assembly import Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.superfrusta.feature_unions import with_common_outlines
from tests.superfrusta.trees import drawn

_PLATE = Part(Box((60, 40, 4)))


def united(*parts: tuple[bool, Part]) -> tuple[list[Part], float]:
    """The parts, in lengths as given, and by how much R changes."""
    search, tree, scale = drawn(*parts, sides=4)
    after = with_common_outlines(search, tree)
    change = after.score - search.scored(tree).score
    return [f.part.scaled(1 / scale) for f in after.features], change


def twice(field: Box | Cylinder, place: tuple[float, float, float], x: float) -> Part:
    """At a place and beside it."""
    return Part(field, place, instances=(Similarity(translation=(x, 0, 0)),))


def test_two_plates_that_make_an_angle_are_one_outline() -> None:
    """In the place of either, so that the hole stays one."""
    wall, hole = Part(Box((4, 40, 30)), (-28, 0, 13)), Part(Cylinder(5, 20), (10, 0, 0))
    (angle, bore), change = united((True, _PLATE), (False, hole), (True, wall))
    assert isinstance(angle.field, Extrusion)
    assert angle.field.height == pytest.approx(40)
    assert angle.field.profile.area == pytest.approx(60 * 4 + 26 * 4, rel=1e-4)
    assert len(angle.field.profile.corners) == 6
    assert isinstance(bore.field, Cylinder)
    assert abs(change) < 1e-4


def test_pieces_of_a_pocket_and_of_its_copy_are_one_with_a_copy() -> None:
    wide, narrow = (twice(Box(size), (x, 0, 3), 30) for size, x in (((10, 20, 4), -15), ((6, 8, 4), -7)))
    (_, pocket), change = united((True, _PLATE), (False, wide), (False, narrow))
    assert isinstance(pocket.field, Extrusion)
    assert pocket.field.profile.area == pytest.approx(10 * 20 + 6 * 8, rel=1e-4)
    assert len(pocket.copies) == 2
    assert abs(change) < 1e-4


def test_a_profile_on_one_that_is_the_same_is_that_one() -> None:
    """Their lengths add up."""
    section = Extrusion(Profile.regular(6, 20), 10)
    (whole,), _ = united((True, Part(section)), (True, Part(section, (0, 0, 10))))
    assert isinstance(whole.field, Extrusion)
    assert whole.field.height == pytest.approx(20)
    assert len(whole.field.profile.corners) == 6


def test_a_boss_and_a_pattern_of_feet_stay() -> None:
    """Also where the feet are as wide as the plate, so that they have an outline in common with it."""
    moves = [Similarity(translation=(x, 0, 0)) for x in (18, 36, 54)]
    feet = Part(Box((6, 40, 10)), (-27, 0, -5), instances=tuple(moves))
    for other in (Part(Cylinder(10, 20), (0, 0, 10)), feet):
        parts, change = united((True, _PLATE), (True, other))
        assert [len(part.copies) for part in parts] == [1, len(other.copies)]
        assert change == 0
