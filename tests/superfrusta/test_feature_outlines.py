"""Corners of outlines that nothing shows go; those that the solid has stay."""

from __future__ import annotations

import math

import pytest

from partwright.assembly import Part
from partwright.fields import Box, Cylinder, Extrusion, Field, Profile, Revolution
from partwright.superfrusta.feature_outlines import with_plain_outlines
from tests.superfrusta.trees import drawn

_UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # y is up
_DISC = Part(Revolution(Profile.polygon([(5, 0), (20, 0), (20, 5), (9, 5), (9, 20), (5, 20)])))


def plain(*parts: tuple[bool, Part]) -> tuple[list[Field], float]:
    """The fields with plainer outlines, in lengths as given, and by how much R changes."""
    search, tree, scale = drawn(*parts, sides=9)
    after = with_plain_outlines(search, tree)
    change = search.scored(after).score - search.scored(tree).score
    return [f.part.scaled(1 / scale).field for f in after.features], change


def test_a_rib_that_was_read_off_a_section_of_the_whole_is_a_triangle() -> None:
    """Through the disc that it stands on and the hub behind it."""
    section = Profile.polygon([(5, 0), (19, 0), (19, 5), (18, 5), (8, 17), (8, 20), (5, 20)])
    rib = Part(Extrusion(section, 4), rotation=_UPRIGHT)
    (disc, after), change = plain((True, _DISC), (True, rib))
    assert disc.profile.corners.shape == (6, 3)
    assert len(after.profile.outline) == 3
    assert after.height == pytest.approx(4)
    assert abs(change) < 1e-3


def test_a_gap_along_a_wall_that_it_takes_away_is_a_box() -> None:
    """And not one whose wall is left."""
    bar = Part(Cylinder(5, 40), rotation=_UPRIGHT)
    plate = Part(Box((30, 40, 4)), (15, 0, 0))
    follows = Profile(((8, -6, 0.0), (8, 6, 0.0), (0, 6, 1.0), (0, -6, 0.0)))
    gap = Part(Extrusion(follows, 10), rotation=_UPRIGHT)
    (*_, after), change = plain((True, bar), (True, plate), (False, gap))
    assert isinstance(after, Box)
    assert sorted(after.size) == pytest.approx([10, 12, 14])
    assert abs(change) < 1e-3


def test_what_is_seen_stays() -> None:
    angle = Part(Extrusion(Profile.polygon([(0, 0), (30, 0), (30, 4), (4, 4), (4, 20), (0, 20)]), 10))
    slot = Part(Extrusion(Profile(((6, 1, 0), (12, 1, 0.5), (12, 3, 0), (6, 3, 0))), 20))
    fields, change = plain((True, angle), (False, slot))
    assert [len(field.profile.outline) for field in fields] == [6, 4]
    assert change == 0


def test_a_corner_on_a_straight_wall_goes() -> None:
    """Where two readings of one wall met, a few microns apart."""
    stepped = Profile.polygon([(5, 0), (20, 0), (20, 5), (9.003, 5), (9, 12), (9, 20), (5, 20)])
    (field,), _ = plain((True, Part(Revolution(stepped))))
    assert len(field.profile.outline) == 6
