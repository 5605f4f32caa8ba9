"""Round holes that a tree fills are drilled, each size once, or told; none of others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.fields.profile import circle
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_drilling import (
    empty_round_holes,
    hole_warnings,
    with_holes_drilled,
    without_feature,
)
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

PLATE = Part(Box((180.0, 100.0, 6.0)))
MOVES = [Similarity(translation=(x, y, 0.0)) for x, y in ((140, 0), (0, 80), (140, 80))]
SMALL = Part(Cylinder(1.0, 8.0), (-70.0, -40.0, 0.0), instances=tuple(MOVES))
BORE = Part(Cylinder(20.0, 8.0))
SHAPE = pw.load_shape(mesh_assembly(Assembly((PLATE, SMALL, BORE), operation="difference")), unit="mm")


@pytest.mark.parametrize(("most", "copies"), [(None, 4), (2, 0)])
def test_what_a_tree_fills_is_drilled_within_the_budget(most: int | None, copies: int) -> None:
    settings = Settings.for_quality("draft")
    search = FeatureSearch(SHAPE, FitSamples.of(SHAPE, settings), settings.alpha, most=most)
    drawn = in_unit_frame(SHAPE, Assembly((PLATE, BORE), operation="difference"))
    none = np.zeros(0, bool)
    plate, bore = drawn.parts
    tree = search.scored(FeatureTree([Feature(True, plate, none, 4), Feature(False, bore, none, 2)]))
    holes = empty_round_holes(SHAPE)
    assert len(holes) == 5
    drilled = with_holes_drilled(search, tree, holes)
    assert drilled.price == tree.price
    assert drilled.score == search.scored(drilled).score >= tree.score
    result = FeatureAssembly(SHAPE).named(drilled)
    found = {part.name: (part.field.radius, len(part.copies)) for part in result.parts[1:]}
    assert found == {"hole": (20.0, 1)} | ({"bolt_hole": (1.0, copies)} if copies else {})
    left = without_feature(holes, in_unit_frame(SHAPE, result).distance)
    told = hole_warnings(SHAPE, left)
    assert len(left) == 4 - copies
    assert told == () if copies else told[0].startswith("left out: 4 round holes, up to 2 mm wide, at the")


def test_a_tree_that_is_long_has_its_holes_too() -> None:
    """Its length is what the search allows itself, and not what was asked for."""
    settings = Settings.for_quality("draft")
    search = FeatureSearch(SHAPE, FitSamples.of(SHAPE, settings), settings.alpha)
    plate, bore = in_unit_frame(SHAPE, Assembly((PLATE, BORE), operation="difference")).parts
    none = np.zeros(0, bool)
    cuts = [replace(bore, translation=(0.0, 0.0, 3.0 + k)) for k in range(search.limit)]  # of nothing
    features = [Feature(True, plate, none, 4), *(Feature(False, cut, none, 2) for cut in (*cuts, bore))]
    drilled = with_holes_drilled(search, search.scored(FeatureTree(features)), empty_round_holes(SHAPE))
    assert len(drilled.features) == len(features) + 1
    assert len(drilled.features[-1].part.copies) == 4


def test_a_hole_that_a_copy_has_only_in_the_tree_is_none_of_it() -> None:
    """Two ears of one outline, drilled at different places: the outline's own hole gives way to both."""
    plain = Profile.rectangle(60.0, 40.0)
    apart = Similarity(translation=(0.0, 0.0, 80.0))
    web = Part(Box((10.0, 40.0, 80.0)), (-25.0, 0.0, 40.0))
    holes = [Part(Cylinder(4.0, 12.0), (10.0, y, z)) for y, z in ((0.0, 0.0), (10.0, 80.0))]
    ears = Part(Extrusion(plain, 8.0), instances=(apart,))
    shape = pw.load_shape(mesh_assembly(Assembly((Assembly((web, ears)), *holes), operation="difference")))
    drilled = Profile(plain.outline, (tuple((x + 10.0, y, b) for x, y, b in circle(4.0)),))
    settings = Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    own = in_unit_frame(shape, Assembly((Part(Extrusion(drilled, 8.0), instances=(apart,)), web)))
    tree = search.scored(FeatureTree([Feature(True, part, np.zeros(0, bool), 4) for part in own.parts]))
    result = FeatureAssembly(shape).named(with_holes_drilled(search, tree, empty_round_holes(shape)))
    assert mesh_assembly(result).volume == pytest.approx(shape.volume, rel=1e-3)
    assert not without_feature(empty_round_holes(shape), in_unit_frame(shape, result).distance)
    middles = shape.frame.to_unit(np.array([(10.0, y, z) for z in (0.0, 80.0) for y in (0.0, 10.0)]))
    assert (in_unit_frame(shape, result).distance(middles) < 0).tolist() == [False, True, True, False]


def test_what_stands_in_a_ring_is_not_drilled_away() -> None:
    ring = Part(Cylinder(30.0, 6.0), (0.0, 0.0, 3.0))
    post = Part(Cylinder(20.0, 12.0))
    whole = Assembly((Assembly((PLATE, ring), operation="difference"), post))
    assert not empty_round_holes(pw.load_shape(mesh_assembly(whole)))


def test_a_ring_in_which_another_part_stands_keeps_its_hole() -> None:
    ring = Part(Extrusion(Profile(circle(60.0), (circle(30.0),)), 8.0))
    shaft = Part(Cylinder(25.0, 40.0))
    bridge = Part(Box((80.0, 6.0, 4.0)))
    shape = pw.load_shape(mesh_assembly(Assembly((ring, shaft, bridge))))
    settings = Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    own = in_unit_frame(shape, Assembly((ring, shaft, bridge)))
    tree = search.scored(FeatureTree([Feature(True, part, np.zeros(0, bool), 4) for part in own.parts]))
    assert with_holes_drilled(search, tree, empty_round_holes(shape)) is tree
