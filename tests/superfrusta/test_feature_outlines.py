"""Corners of outlines that nothing shows go; those that the solid has stay."""

from __future__ import annotations

import math

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Extrusion, Field, Profile, Revolution
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import in_unit_frame
from partwright.superfrusta.feature_outlines import with_plain_outlines
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

_UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # y is up
_DISC = Part(Revolution(Profile.polygon([(5, 0), (20, 0), (20, 5), (9, 5), (9, 20), (5, 20)])))


def plain(*parts: tuple[bool, Part]) -> tuple[list[Field], float]:
    """The fields with plainer outlines, in lengths as given, and by how much R changes."""
    drawn = Assembly((parts[0][1],))
    for added, part in parts[1:]:
        drawn = Assembly((drawn, part), "union" if added else "difference")
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    none = np.zeros(0, bool)
    own = in_unit_frame(shape, drawn).parts
    tree = FeatureTree([Feature(added, part, none, 9) for (added, _), part in zip(parts, own, strict=True)])
    after = with_plain_outlines(search, tree)
    change = search.scored(after).score - search.scored(tree).score
    return [f.part.scaled(1 / shape.frame.scale).field for f in after.features], change


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
